/* The table as SVG: what is drawn, how it is looked at, and what the pointer does to it. */

import { RAD, box, centroid, corners, find, isCircle, number, path, place, radians, rounded, say, set, size, svg, turned, within } from "./geometry.js";

const REACH = 26;  /* of the handle that turns, beyond the outline [px] */
const SNAP = 15;   /* degrees, with Shift */
const ENDS = ["goal", "start"];

/* So many children of a node; those that are there stay. */
function children(node, count, make) {
  while (node.children.length > count) node.lastChild.remove();
  while (node.children.length < count) node.append(make());
  return [...node.children];
}

export class Table {
  constructor(model, connection) {
    this.model = model; this.connection = connection;
    this.node = find("table");
    find("plan").append(svg("g"), svg("g"), svg("g"));   /* transits, pushes, their numbers */
    find("names").append(...ENDS.map((name) => svg("text", { class: `name ${name}` }, name)));
    this.view = { x: 0, y: 0, unit: 1 };   /* middle of the screen [mm], mm to a pixel */
    this.pointers = new Map();
    this.drag = null;
    this.sketch = null;                    /* corners of an outline that is being drawn */
    this.touched = false;                  /* whether somebody has looked elsewhere */
    this.latencies = [];
    this.frame = this.node.getBoundingClientRect();   /* asked for only when it changes: asking lays the page out */
    model.addEventListener("loaded", () => { this.touched = false; this.fit(); });
    model.addEventListener("changed", () => this.drawScene());
    model.addEventListener("selected", () => this.drawScene());
    new ResizeObserver(() => { this.measure(); if (this.touched) this.look(); else this.fit(); }).observe(this.node);
    window.addEventListener("scroll", () => this.measure());
    this.node.addEventListener("pointerdown", (event) => this.down(event));
    this.node.addEventListener("pointermove", (event) => this.move(event));
    this.node.addEventListener("pointerrawupdate", (event) => this.soon(event));
    this.node.addEventListener("pointerup", (event) => this.up(event));
    this.node.addEventListener("pointercancel", (event) => this.up(event));
    this.node.addEventListener("dblclick", (event) => this.double(event));
    this.node.addEventListener("focusin", (event) => {
      const item = event.target.dataset.item;
      if (item && !this.drag) model.select(item);
    });
    this.node.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.zoom(Math.exp(Math.max(-60, Math.min(60, event.deltaY)) * 0.004), [event.offsetX, event.offsetY]);
    }, { passive: false });
  }

  /* ---- how it is looked at ---- */

  measure() { this.frame = this.node.getBoundingClientRect(); }

  get wide() { return this.frame.width || 1; }

  get high() { return this.frame.height || 1; }

  fit() {
    const { scene, plan } = this.model;
    if (!scene) return;
    const outline = corners(scene.object.outline), lines = [];
    const middle = centroid(outline), reach = 0.5 * size(outline);
    for (const pose of [scene.start, scene.goal])
      lines.push([...outline, [middle[0] + reach, middle[1]]].map((p) => place(radians(pose), p)));
    for (const obstacle of this.model.obstacles) lines.push(corners(obstacle));
    const bounds = (scene.workspace || {}).bounds;
    if (bounds) lines.push([[bounds[0], bounds[1]], [bounds[2], bounds[3]]]);
    if (plan && plan.traces) for (const trace of plan.traces) {
      lines.push(trace.tips);
      if (trace.flat) lines.push(trace.flat);
      for (const ghost of trace.ghosts) lines.push(outline.map((p) => place(ghost, p)));
    }
    const way = this.run.motion ? this.run.motion.object : [];
    way.filter((_, k) => k % 30 === 0).concat(way.slice(-1)).forEach((pose) => lines.push(outline.map((p) => place(pose, p))));
    const [x0, y0, x1, y1] = box(lines), margin = 0.1 * size(outline);
    this.view = {
      x: (x0 + x1) / 2, y: (y0 + y1) / 2,
      unit: Math.max((x1 - x0 + 2 * margin) / Math.max(this.wide - 90, 100), (y1 - y0 + 2 * margin) / Math.max(this.high - 90, 100)),
    };
    this.look();
  }

  zoom(factor, at = [this.wide / 2, this.high / 2]) {
    this.touched = true;
    const [x, y] = this.world(at), unit = Math.min(Math.max(this.view.unit * factor, 1e-3), 1e4), share = unit / this.view.unit;
    this.view = { x: x + (this.view.x - x) * share, y: y + (this.view.y - y) * share, unit };
    this.look();
  }

  look() {
    const { x, y, unit } = this.view, w = this.wide * unit, h = this.high * unit;
    set(this.node, { viewBox: [x - w / 2, -y - h / 2, w, h].map((v) => v.toFixed(4)).join(" ") });
    this.node.style.setProperty("--u", unit + "px");
    this.drawGrid();
    if (this.model.scene) this.drawScene();
    this.drawPlan();
  }

  /* From pixels of the picture to mm of the table. */
  world([px, py]) {
    const { x, y, unit } = this.view;
    return [x + (px - this.wide / 2) * unit, y - (py - this.high / 2) * unit];
  }

  at(event) {
    return this.world([event.clientX - this.frame.left, event.clientY - this.frame.top]);
  }

  /* ---- what is drawn ---- */

  drawGrid() {
    const { x, y, unit } = this.view, w = this.wide * unit / 2, h = this.high * unit / 2;
    const least = 70 * unit, power = 10 ** Math.floor(Math.log10(least));
    const step = [1, 2, 5, 10].map((m) => m * power).find((s) => s >= least);
    const parts = [], lines = [], digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
    for (let v = Math.ceil((x - w) / step) * step; v <= x + w; v += step) {
      lines.push(`M${v.toFixed(4)} ${-y - h}V${-y + h}`);
      if (v > x - w + 50 * unit && v < x + w - 60 * unit) parts.push(svg("text", { class: "x", x: v.toFixed(4), y: -y + h - 7 * unit }, number(v, digits)));
    }
    for (let v = Math.ceil((y - h) / step) * step; v <= y + h; v += step) {
      lines.push(`M${x - w} ${(-v).toFixed(4)}H${x + w}`);
      if (v > y - h + 26 * unit && v < y + h - 10 * unit) parts.push(svg("text", { class: "y", x: x - w + 6 * unit, y: (-v).toFixed(4) }, number(v, digits)));
    }
    parts.push(svg("text", { class: "y", x: x - w + 6 * unit, y: -y + h - 11 * unit }, "mm"));
    find("grid").replaceChildren(svg("path", { d: lines.join("") }), ...parts);
  }

  drawScene() {
    const { scene, selected } = this.model;
    if (!scene) return;
    const unit = this.view.unit, outline = scene.object.outline, shape = path(corners(outline));
    const middle = centroid(outline), reach = 0.5 * size(outline) + REACH * unit, mark = 0.18 * size(outline);
    const names = [];
    for (const name of ENDS) {
      const pose = radians(scene[name]), node = find(name), free = name === "goal" && scene.goal[2] === "free";
      const shown = free && this.model.plan && this.model.plan.goal ? this.model.plan.goal : pose;
      const angle = shown[2];
      set(node, {
        transform: `translate(${shown[0]} ${shown[1]}) rotate(${angle / RAD})`,
        "aria-label": `${name}, x ${number(pose[0], 1)} mm, y ${number(pose[1], 1)} mm, ` + (free ? "any angle" : `${number(scene[name][2], 1)}°`),
      });
      node.classList.toggle("selected", selected === name);
      const drawn = `${shape} ${free ? "" : reach}`;
      if (node.dataset.drawn !== drawn) {   /* it moves by its transform alone */
        node.dataset.drawn = drawn;
        const parts = [svg("path", { class: "body", d: shape })];
        if (!free) parts.push(
          svg("path", { d: `M${middle[0]} ${middle[1]}h${mark}` }),
          svg("line", { x1: middle[0] + mark, y1: middle[1], x2: middle[0] + reach, y2: middle[1] }),
          svg("g", { class: "handle", "data-part": "turn" },
            svg("circle", { class: "touch", cx: middle[0] + reach, cy: middle[1] }),
            svg("circle", { class: "see", cx: middle[0] + reach, cy: middle[1] })));
        node.replaceChildren(...parts);
      }
      /* A name stands below its outline. */
      const low = corners(outline).map((p) => place(shown, p)).reduce((a, b) => (b[1] < a[1] ? b : a));
      names.push([place(shown, middle)[0], 13 * unit - low[1]]);
    }
    const [one, other] = names;
    if (Math.hypot(one[0] - other[0], one[1] - other[1]) < 16 * unit) other[1] = one[1] + 17 * unit;
    [...find("names").children].forEach((node, k) => set(node, { x: names[k][0], y: names[k][1] }));
    this.drawObstacles();
    const bounds = (scene.workspace || {}).bounds;
    find("bounds").style.display = bounds ? "" : "none";
    if (bounds) set(find("bounds"), { x: bounds[0], y: bounds[1], width: bounds[2] - bounds[0], height: bounds[3] - bounds[1] });
    const sketch = this.sketch ? this.sketch.concat(this.sketch.hover ? [this.sketch.hover] : []) : [];
    set(find("sketch"), { d: path(sketch, sketch.length > 2) });
  }

  drawObstacles() {
    const { obstacles, selected } = this.model, group = find("obstacles");
    while (group.children.length > obstacles.length) group.lastChild.remove();
    while (group.children.length < obstacles.length) group.append(svg("g", { class: "item obstacle", tabindex: 0, role: "button" }, svg("path", { class: "body" })));
    obstacles.forEach((obstacle, k) => {
      const node = group.children[k], [x, y] = centroid(obstacle);
      set(node, { "data-item": `obstacle:${k}`, "aria-label": `obstacle ${k}, x ${number(x, 0)} mm, y ${number(y, 0)} mm` });
      node.classList.toggle("selected", selected === `obstacle:${k}`);
      set(node.firstChild, { d: path(corners(obstacle)) });
    });
    const handles = [], chosen = selected.startsWith("obstacle:") ? obstacles[Number(selected.split(":")[1])] : null;
    const handle = (part, [x, y], kind = "") => svg("g", { class: `handle ${kind}`, "data-item": selected, "data-part": part },
      svg("circle", { class: "touch", cx: x, cy: y }), svg("circle", { class: "see", cx: x, cy: y }));
    if (chosen && isCircle(chosen)) handles.push(handle("radius", [centroid(chosen)[0] + chosen.circle, centroid(chosen)[1]]));
    else if (chosen) {
      const far = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1]) > 44 * this.view.unit;
      chosen.forEach((p, k) => {
        const q = chosen[(k + 1) % chosen.length];
        if (far(p, q)) handles.push(handle(`edge:${k}`, [(p[0] + q[0]) / 2, (p[1] + q[1]) / 2], "middle"));
      });
      chosen.forEach((p, k) => handles.push(handle(`corner:${k}`, p)));
    }
    find("handles").replaceChildren(...handles);
  }

  drawPlan() {
    const { plan, scene, selected } = this.model, group = find("plan"), unit = this.view.unit;
    if (!scene) return;
    const outline = corners(scene.object.outline), shape = path(outline), tip = Math.max(scene.pusher.tip_radius, 1.3 * unit);
    const taken = [], traces = plan && plan.traces ? plan.traces : [], transits = plan && plan.transits ? plan.transits : [];
    const [ways, pushes, numbers] = group.children;
    children(ways, transits.length, () => svg("path", { class: "transit" })).forEach((node, k) => set(node, { d: path(transits[k], false) }));
    children(pushes, traces.length, () => svg("g", {}, svg("g"), svg("path", { class: "trail" }), svg("path"))).forEach((node, k) => {
      const trace = traces[k], [ghosts, trail, flat] = node.children;
      set(node, { class: "push" + (selected === `push:${k}` ? " chosen" : ""), style: `--c:${trace.colour}` });
      children(ghosts, trace.ghosts.length, () => svg("path", { class: "ghost" })).forEach((ghost, i) => {
        const [x, y, angle] = trace.ghosts[i];
        set(ghost, { d: shape, transform: `translate(${x} ${y}) rotate(${angle / RAD})` });
      });
      set(trail, { d: trace.tips.map(([x, y]) => `M${x - tip} ${y}a${tip} ${tip} 0 1 0 ${2 * tip} 0a${tip} ${tip} 0 1 0 ${-2 * tip} 0`).join("") });
      set(flat, { class: trace.slides ? "flat slide" : "flat", d: trace.flat ? path(trace.flat, false) : "" });
    });
    children(numbers, traces.length, () => svg("g", { class: "push number" }, svg("circle"), svg("text", { transform: "scale(1 -1)" }))).forEach((node, k) => {
      const trace = traces[k], way = trace.flat || trace.ghosts;
      const free = way.find((p, i) => i > 0 && taken.every((q) => Math.hypot(p[0] - q[0], p[1] - q[1]) >= 21 * unit)) || way[0];
      taken.push(free);
      set(node, { "data-item": `push:${k}`, style: `--c:${trace.colour}`, transform: `translate(${free[0]} ${free[1]})` });
      say(node.lastChild, String(k + 1));
    });
    /* Where pushes are refused, at the start. */
    const d = 5 * unit, refused = plan ? (plan.places || []).filter((spot) => spot.refusal) : [];
    const pose = radians(scene.start);
    find("places").replaceChildren(...(plan && plan.status !== "solved" ? refused : []).map((spot) => {
      const [x, y] = place(pose, spot.at);
      return svg("g", { class: "place", transform: `translate(${x} ${y})` }, svg("path", { d: `M${-d} ${-d}L${d} ${d}M${-d} ${d}L${d} ${-d}` }), svg("title", {}, `${spot.name}: ${spot.refusal}`));
    }));
    group.classList.toggle("stale", Boolean(plan && plan.stale));
    this.blame(plan && plan.status !== "solved" ? plan.reason || "" : "");
  }

  /* What the reason names stands out: the end that does not fit, what it meets, and where a way is too narrow. */
  blame(reason) {
    const width = /no way is wider than ([\d.]+) mm/.exec(reason), spot = /narrowest at \((-?[\d.]+), (-?[\d.]+)\) mm/.exec(reason);
    if (width && spot) find("places").append(svg("circle", { class: "narrow", cx: spot[1], cy: spot[2], r: width[1] / 2 }, svg("title", {}, `the widest way: ${width[1]} mm`)));
    const named = [...reason.matchAll(/\bobstacle (\d+)/g)].map(([, k]) => Number(k));
    [...find("obstacles").children].forEach((node, k) => node.classList.toggle("blamed", named.includes(k)));
    for (const name of ENDS) find(name).classList.toggle("blamed", reason.includes(`at the ${name} `));
    find("bounds").classList.toggle("blamed", reason.includes(" side of the bounds"));
  }

  /* ---- the pointer ---- */

  down(event) {
    if (event.button > 0) return;
    const screen = [event.clientX, event.clientY];
    this.pointers.set(event.pointerId, screen);
    if (this.pointers.size === 2) { this.hand.up(); this.drag = this.pinch(); return; }
    if (this.pointers.size > 2) return;
    if (this.sketch) { this.sketchAt(this.at(event)); return; }
    if (this.hand.on) { this.node.setPointerCapture(event.pointerId); this.hand.down(this.at(event)); return; }
    const part = event.target.closest("[data-part]"), item = event.target.closest("[data-item]");
    const from = this.at(event), { scene } = this.model;
    this.node.setPointerCapture(event.pointerId);
    this.drag = { kind: "pan", from, view: { ...this.view }, screen, moved: false, item: "" };
    if (this.feedback.on && this.feedback.pose && event.target.closest("#object")) {
      this.drag = { ...this.drag, kind: "shove", pose: this.feedback.pose };
      document.body.classList.add("dragging");
      return;
    }
    if (item) {
      const name = item.dataset.item;
      this.model.select(name);
      item.focus({ preventScroll: true });
      if (!name.startsWith("push")) this.drag = { ...this.drag, kind: "item", item: name, part: part ? part.dataset.part : "body", scene, gesture: `drag ${performance.now()}` };
    }
    if (this.drag.kind === "item") document.body.classList.add("dragging");
  }

  pinch() {
    const [a, b] = [...this.pointers.values()];
    return { kind: "pinch", apart: Math.hypot(a[0] - b[0], a[1] - b[1]), middle: [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2], view: { ...this.view } };
  }

  move(event) {
    if (this.pointers.has(event.pointerId)) this.pointers.set(event.pointerId, [event.clientX, event.clientY]);
    if (this.sketch) { this.sketch.hover = this.at(event); this.drawScene(); return; }
    if (this.hand.on && !this.drag) { this.hand.move(this.at(event)); return; }
    const drag = this.drag;
    if (!drag) return;
    if (drag.kind === "pinch") {
      if (this.pointers.size < 2) return;
      const now = this.pinch(), factor = drag.apart / Math.max(now.apart, 1);
      this.view = { ...drag.view };
      this.zoom(factor, [drag.middle[0] - this.frame.left, drag.middle[1] - this.frame.top]);
      this.view.x -= (now.middle[0] - drag.middle[0]) * this.view.unit;
      this.view.y += (now.middle[1] - drag.middle[1]) * this.view.unit;
      this.look();
      return;
    }
    if (!drag.moved && Math.hypot(event.clientX - drag.screen[0], event.clientY - drag.screen[1]) < 3) return;
    drag.moved = true;
    if (drag.kind === "shove") {
      const [x, y] = this.at(event);
      this.feedback.shove([drag.pose[0] + x - drag.from[0], drag.pose[1] + y - drag.from[1], drag.pose[2]]);
      return;
    }
    if (drag.kind === "pan") {
      this.touched = true;
      this.view = { ...drag.view, x: drag.view.x - (event.clientX - drag.screen[0]) * drag.view.unit, y: drag.view.y + (event.clientY - drag.screen[1]) * drag.view.unit };
      this.look();
      return;
    }
    this.touched = true;
    const to = this.at(event), shift = [to[0] - drag.from[0], to[1] - drag.from[1]];
    this.model.change((scene) => this.dragged(scene, drag, to, shift, event.shiftKey), drag.gesture, event.timeStamp);
  }

  /* Where the pointer goes is known before the next frame: what follows from it is asked for at once. */
  soon(event) {
    const { drag, connection, hand } = this;
    if (hand.on && !drag && !this.sketch) { hand.move(this.at(event)); hand.step(); return; }
    if (!drag || drag.kind !== "item" || !drag.moved || connection.asked) return;
    const to = this.at(event), scene = structuredClone(this.model.scene);
    this.dragged(scene, drag, to, [to[0] - drag.from[0], to[1] - drag.from[1]], event.shiftKey);
    connection.plan(scene, event.timeStamp, true);
  }

  dragged(scene, drag, to, [dx, dy], snap) {
    const name = drag.item;
    const moved = ([x, y]) => [rounded(x + dx, 2), rounded(y + dy, 2)];
    if (name === "start" || name === "goal") {
      const old = drag.scene[name], pose = radians(old);
      if (drag.part !== "turn") scene[name] = [...moved(old), old[2]];
      else {
        const middle = place(pose, centroid(scene.object.outline));
        let angle = within(Math.atan2(to[1] - middle[1], to[0] - middle[0]) / RAD);
        angle = snap ? SNAP * Math.round(angle / SNAP) : rounded(angle, 1);
        scene[name] = turned(old, scene.object.outline, angle - old[2]);
        scene[name][2] = within(angle);
      }
      return;
    }
    const k = Number(name.split(":")[1]), old = drag.scene.workspace.obstacles[k];
    const all = scene.workspace.obstacles, [what, which] = drag.part.split(":");
    if (isCircle(old)) {
      all[k] = what === "radius" ? { ...old, circle: Math.max(rounded(Math.hypot(to[0] - old.centre[0], to[1] - old.centre[1]), 2), 0.5) } : { ...old, centre: moved(old.centre) };
    } else if (what === "corner") all[k] = old.map((p, i) => (i === Number(which) ? moved(p) : p));
    else if (what === "edge") {
      const i = Number(which), p = old[i], q = old[(i + 1) % old.length];
      all[k] = [...old.slice(0, i + 1), moved([(p[0] + q[0]) / 2, (p[1] + q[1]) / 2]), ...old.slice(i + 1)];
    } else all[k] = old.map(moved);
  }

  up(event) {
    this.pointers.delete(event.pointerId);
    if (this.hand.on) this.hand.up();
    document.body.classList.remove("dragging");
    const drag = this.drag;
    this.drag = null;
    if (drag && drag.kind === "pan" && !drag.moved && !event.target.closest("[data-item]")) this.model.select("");
    this.model.gesture = "";
  }

  /* A corner that is clicked twice goes. */
  double(event) {
    const part = event.target.closest("[data-part]");
    if (this.sketch) { event.preventDefault(); this.finish(); return; }
    if (!part || !part.dataset.part.startsWith("corner:")) return;
    const k = Number(part.dataset.item.split(":")[1]), which = Number(part.dataset.part.split(":")[1]);
    this.model.change((scene) => {
      const corners = scene.workspace.obstacles[k];
      if (corners.length > 3) corners.splice(which, 1);
    });
  }

  /* ---- an outline by clicking ---- */

  begin() {
    this.sketch = [];
    document.body.classList.add("drawing");
    this.model.select("");
    find("hint").textContent = "Click the corners of the object. A click on the first corner, a double click or Enter closes the outline; Escape gives up.";
    this.drawScene();
  }

  sketchAt(point) {
    const near = (p) => Math.hypot(p[0] - point[0], p[1] - point[1]) < 12 * this.view.unit;
    if (this.sketch.length > 2 && near(this.sketch[0])) { this.finish(); return; }
    if (!this.sketch.some(near)) this.sketch.push(point.map((v) => rounded(v, 2)));
    this.drawScene();
  }

  finish() {
    const drawn = this.sketch;
    this.cancel();
    if (!drawn || drawn.length < 3) return;
    const middle = centroid(drawn);
    this.model.change((scene) => {
      newOutline(scene, drawn.map((p) => [rounded(p[0] - middle[0], 3), rounded(p[1] - middle[1], 3)]), "drawn object");
      scene.start = [rounded(middle[0], 2), rounded(middle[1], 2), 0];
    });
  }

  cancel() {
    this.sketch = null;
    document.body.classList.remove("drawing");
    find("hint").textContent = "";
    this.drawScene();
  }
}

/* The object of a scene gets another outline: it presses evenly, and where it is pushed is found anew. */
export function newOutline(scene, outline, name) {
  scene.object = { name, outline, support: "uniform", friction: scene.object.friction };
  scene.pushes = "auto";
}
