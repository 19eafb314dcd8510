/* The limit surface of a push, seen from aside: where its friction cone meets it, and where the wrench is now. */

import { RAD, find, number, set, svg } from "./geometry.js";

const UP = 22 * RAD;   /* from which it is seen */
const REACH = 1.45;

export class Surface {
  constructor() {
    this.told = null;
    find("around").addEventListener("input", () => this.draw());
    const node = find("surfacepicture");
    node.addEventListener("pointerdown", (event) => { node.setPointerCapture(event.pointerId); this.from = [event.clientX, Number(find("around").value)]; });
    node.addEventListener("pointermove", (event) => {
      if (!this.from || !event.buttons) return;
      find("around").value = ((this.from[1] - event.clientX + this.from[0]) % 360 + 540) % 360 - 180;
      this.draw();
    });
    node.addEventListener("pointerup", () => { this.from = null; });
  }

  show(told) {
    this.told = told && told.mesh ? told : null;
    find("surface").hidden = !this.told;
    this.draw();
  }

  get around() { return Number(find("around").value) * RAD; }

  seen([x, y, z]) {
    const a = this.around, c = Math.cos(a), s = Math.sin(a);
    return [-s * x + c * y, -(Math.cos(UP) * z - Math.sin(UP) * (c * x + s * y))];
  }

  near([x, y, z]) { const a = this.around; return Math.cos(UP) * (Math.cos(a) * x + Math.sin(a) * y) + Math.sin(UP) * z >= 0; }

  line(points) { return "M" + points.map((p) => this.seen(p).map((v) => v.toFixed(3)).join(" ")).join("L"); }

  draw() {
    const { told } = this, group = find("surfacemesh");
    if (!told) { group.replaceChildren(); return; }
    const { mesh } = told, lines = [...mesh, ...mesh[0].map((_, k) => [[0, 0, -1], ...mesh.map((ring) => ring[k]), [0, 0, 1]])];
    const front = [], back = [];
    for (const points of lines) for (let k = 1; k < points.length; k++) (this.near(points[k]) && this.near(points[k - 1]) ? front : back).push(this.line([points[k - 1], points[k]]));
    const axes = [[REACH, 0, 0], [0, REACH, 0], [0, 0, REACH]];
    const text = (point, words) => { const [x, y] = this.seen(point); return svg("text", { x: 1.08 * x, y: 1.08 * y }, words); };
    group.replaceChildren(
      svg("path", { class: "behind", d: back.join("") }),
      svg("path", { class: "axes", d: axes.map((p) => this.line([[0, 0, 0], p])).join("") }),
      svg("path", { class: "infront", d: front.join("") }),
      svg("path", { class: "edge", d: this.line(told.edge) + "Z" }),
      svg("line", { class: "wrench" }), svg("circle", { class: "wrench", r: 0.075 }),
      text(axes[0], "fx"), text(axes[1], "fy"), text(axes[2], "τ"));
    this.at(this.arc);
  }

  /* The wrench of an arc of the push, by its number; -1 where nothing is pushed. */
  at(arc) {
    this.arc = arc;
    if (!this.told) return;
    const now = this.told.arcs[arc], [dot] = document.querySelectorAll("#surfacemesh circle.wrench"), [line] = document.querySelectorAll("#surfacemesh line.wrench");
    dot.style.display = line.style.display = now ? "" : "none";
    find("wrench").textContent = now ? `fx ${share(now.wrench[0])}, fy ${share(now.wrench[1])} of sliding friction, τ ${share(now.wrench[2])} of its moment` : "no wrench: it is not pushed here now";
    if (!now) return;
    const [x, y] = this.seen(now.wrench);
    set(dot, { cx: x, cy: y }); set(line, { x1: 0, y1: 0, x2: x, y2: y });
    dot.classList.toggle("hidden-side", !this.near(now.wrench));
  }
}

const share = (value) => number(100 * value, 0) + " %";
