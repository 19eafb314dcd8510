/* The mechanics of the selected push, drawn on the moving object: cones, turning centres, regions of stable centres. */

import { RAD, arrow, find, path, set, size, corners, svg } from "./geometry.js";
import { Surface } from "./surface.js";

export class Mechanics {
  constructor(model, table, connection, player) {
    this.model = model; this.table = table; this.connection = connection; this.player = player;
    this.shown = null;
    this.surface = new Surface();
    connection.addEventListener("mechanics", (event) => { if (event.detail.push === this.name && event.detail.segment === this.number) { this.shown = event.detail; this.draw(); } });
    connection.addEventListener("done", () => this.ask());
    model.addEventListener("selected", () => { this.shown = null; this.draw(); this.ask(); });
    model.addEventListener("changed", () => { if (!this.name) this.shown = null; });
  }

  /* The number of the push that is selected. */
  get number() { return Number(this.model.selected.split(":")[1]); }

  /* The name of the push that is selected. */
  get name() {
    const { selected, plan } = this.model;
    const trace = selected.startsWith("push:") && plan && plan.traces ? plan.traces[Number(selected.split(":")[1])] : null;
    return trace && !trace.slides ? trace.name : "";
  }

  ask() { if (this.name) this.connection.send("mechanics", { scene: this.model.scene, push: this.name, segment: this.number }); }

  draw() {
    const group = find("mechanics"), told = this.shown, { scene } = this.model, unit = this.table.view.unit;
    this.surface.show(told);
    if (!told || !scene) { group.replaceChildren(); if (find("hint").dataset.of === "mechanics") { find("hint").textContent = ""; find("hint").dataset.of = ""; } return; }
    const parts = [], [x, y] = told.contact, far = 0.4 * size(corners(scene.object.outline));
    for (const area of told.areas) parts.push(svg("path", { d: path(area.corners), style: `fill: ${area.colour}; fill-opacity: ${area.opacity}` }));
    for (const { edges, colour } of told.cones) {
      const [a, b] = edges.map(([dx, dy]) => [x + far * dx, y + far * dy]);
      parts.push(svg("path", { d: path([told.contact, a, b]), style: `fill: ${colour}; fill-opacity: .2; stroke: ${colour}; stroke-width: 1.4px` }));
    }
    if (told.centres.length === 2 && told.flat) parts.push(svg("path", { class: "axis", d: path(told.centres.map((c) => c.at), false) }));
    for (const { points, colour } of told.rays) if (points.length > 1) parts.push(svg("path", { class: "ray", d: path(points, false), style: `stroke: ${colour}` }));
    parts.push(svg("path", { class: "push-force" }), svg("path", { class: "drive" }));
    for (const { at, sign } of told.centres) {
      const d = 4 * unit, [cx, cy] = at;
      parts.push(svg("circle", { class: "turning", cx, cy }), svg("path", { class: "sign", d: `M${cx - d} ${cy}h${2 * d}` + (sign > 0 ? `M${cx} ${cy - d}v${2 * d}` : ""), "data-x": cx, "data-y": cy }));
    }
    if (told.flat) parts.push(svg("circle", { class: "flatpoint", cx: told.flat[0], cy: told.flat[1] }));
    group.replaceChildren(...parts);
    this.follow();
    find("hint").dataset.of = "mechanics";
    find("hint").replaceChildren(...[...told.cones.map((cone) => [cone.colour, cone.name]), ["var(--drive)", "u, how the contact moves"], ...(told.areas.length ? [["#1f5fd0", "turning centres (+ left) that keep both fingers"], ["#c2189b", "(− right)"]] : []), ...(told.rays.length ? [["#1f5fd0", "turning centres (+ left)"], ["#c2189b", "(− right)"]] : [])].flatMap(([colour, name]) => {
      const mark = document.createElement("i"), key = document.createElement("span");
      mark.style.background = colour;
      key.append(mark, name);
      return [key, " "];
    }), " · " + told.caption);
  }

  get angle() { return this.player.motion ? this.player.state(this.player.now).object[2] / RAD : 0; }

  /* The picture goes with the object. */
  follow() {
    set(find("mechanics"), { transform: find("object").getAttribute("transform") || "" });
    const { pushing } = this.player, arc = this.shown && pushing && pushing.push === this.number ? pushing.arc : -1;
    this.surface.at(arc);
    const now = this.shown && this.shown.arcs[arc], drive = document.querySelector("#mechanics .drive"), force = document.querySelector("#mechanics .push-force");
    if (drive) {
      const far = 0.5 * size(corners(this.model.scene.object.outline)), unit = this.table.view.unit;
      set(drive, { d: now ? arrow(this.shown.contact, now.u, far, unit) : "" });
      set(force, { d: now && now.force ? arrow(this.shown.contact, now.force, 0.8 * far, unit) : "" });
    }
    for (const sign of document.querySelectorAll("#mechanics .sign")) set(sign, { transform: `rotate(${-this.angle} ${sign.dataset.x} ${sign.dataset.y})` });
  }
}
