/* Push it yourself: the pointer is a finger, and the plant moves the object under it. */

import { RAD, arrow, centroid, corners, find, number, path, radians, set, size } from "./geometry.js";

const MOST = 20000;   /* rows of a recorded run */
const SOON = 12;      /* between two steps of the finger [ms] */
const READ = 100;     /* between two words about the same mode [ms] */

export class Hand {
  constructor(model, table, connection) {
    this.model = model; this.table = table; this.connection = connection;
    this.on = false;
    this.rows = [];
    this.frames = [];     /* from asking to an answer [ms], for whoever measures */
    connection.addEventListener("pushed", (event) => this.pushed(event.detail));
    connection.addEventListener("closed", () => { this.waiting = false; });
    model.addEventListener("loaded", () => this.turn(false));
  }

  /* Begins where the start is, or ends. */
  turn(on) {
    if (on === this.on) return;
    this.on = on;
    document.body.classList.toggle("pushing", on);
    find("hand").style.display = on ? "" : "none";
    find("hint").textContent = on ? "The pointer is a finger: press beside the object and push it." : "";
    if (!on) return;
    this.object = radians(this.model.scene.start);
    this.finger = this.target = null;
    this.waiting = false;
    this.rows = []; this.began = performance.now();
    this.trail = [];
    this.model.select("");
    this.draw(null);
    this.tick();
  }

  down(point) { this.target = point; this.finger = null; }

  move(point) { if (this.target) this.target = point; }

  up() { this.target = this.finger = null; this.draw(null); }

  /* Once a frame: the finger goes on to where the pointer is. */
  tick() {
    if (!this.on) return;
    requestAnimationFrame(() => this.tick());
    this.step();
  }

  step() {
    const now = performance.now();
    if (!this.target || this.waiting || !this.connection.open || now - this.last < SOON) return;
    const from = this.finger || this.target, still = Math.hypot(from[0] - this.target[0], from[1] - this.target[1]) < 1e-4;
    if (still && this.finger) {   /* it rests: nothing moves */
      if (now - this.last > 250 && !this.resting) { this.resting = true; find("hint").textContent = "at rest"; this.draw(null); }
      return;
    }
    this.resting = false;
    const { object, pusher, planning, start, goal, units, flatpush } = this.model.scene;
    this.waiting = now;
    this.connection.send("hand", {
      scene: { flatpush, units, object, pusher, planning, start, goal }, object: this.object,
      way: [...from, ...this.target], seconds: Math.min(Math.max((now - (this.last || now - 16)) / 1000, 0.004), 0.5),
    });
    this.last = now;
  }

  pushed(answer) {
    if (!this.waiting) return;
    if (this.frames.length < MOST) this.frames.push(performance.now() - this.waiting);
    this.waiting = false;
    if (!this.on) return;
    this.object = answer.object;
    if (!this.target) { this.draw(null); return; }
    this.finger = answer.finger || null;
    const middle = centroid(this.model.scene.object.outline), at = this.object;
    const here = [at[0] + Math.cos(at[2]) * middle[0] - Math.sin(at[2]) * middle[1], at[1] + Math.sin(at[2]) * middle[0] + Math.cos(at[2]) * middle[1]];
    this.trail.push(here);
    this.step();   /* if the last one is long ago: the plant goes on while this one is drawn */
    if (this.finger && this.rows.length < MOST) this.rows.push([(performance.now() - this.began) / 1000, this.object, [...this.finger, 0], answer.mode]);
    this.draw(answer);
    /* Numbers that change in every frame cannot be read. */
    const said = performance.now();
    if (answer.mode === this.mode && said - this.said < READ) return;
    this.mode = answer.mode; this.said = said;
    find("hint").textContent = words(answer);
  }

  draw(answer) {
    const { scene } = this.model, unit = this.table.view.unit, node = find("hand");
    if (!this.on) return;
    const [body, mark, tip, force, trail] = node.children, middle = centroid(scene.object.outline);
    const pose = `translate(${this.object[0]} ${this.object[1]}) rotate(${this.object[2] / RAD})`;
    set(body, { d: path(corners(scene.object.outline)), transform: pose });
    set(mark, { d: `M${middle[0]} ${middle[1]}h${0.18 * size(scene.object.outline)}`, transform: pose });
    const finger = this.finger || this.target;
    tip.style.display = finger ? "" : "none";
    if (finger) set(tip, { cx: finger[0], cy: finger[1], r: Math.max(scene.pusher.tip_radius, 3 * unit) });
    const pushed = answer && answer.force && answer.point;
    force.style.display = pushed ? "" : "none";
    if (pushed) set(force, { d: arrow(answer.point, answer.force, 46 * unit, unit) });
    set(trail, { d: this.trail.length > 1 ? path(this.trail, false) : "" });
  }

  /* The object's pose for the scene's document: mm and degrees. */
  pose() { return [this.object[0], this.object[1], this.object[2] / RAD]; }

  /* What was done, as the player has it. */
  get motion() {
    const modes = [...new Set(this.rows.map((row) => row[3]))];
    return {
      times: this.rows.map((row) => row[0]), object: this.rows.map((row) => row[1]), pusher: this.rows.map((row) => row[2]), height: this.rows.map(() => 0),
      segment: this.rows.map((row) => modes.indexOf(row[3])), segments: modes.map((mode) => ({ contact: mode, action: 1 })),
    };
  }
}

function words(answer) {
  if (answer.outcome === "starts inside") return "The finger stands on the object: press beside it.";
  const parts = [answer.outcome || answer.mode];
  if (answer.twist) {
    const [vx, vy, w] = answer.twist;
    parts.push(`moves ${number(Math.hypot(vx, vy), 1)} mm/s, turns ${number(w, 1)} °/s`, `force along ${number(Math.atan2(answer.force[1], answer.force[0]) / RAD, 0)}°, moment ${number(answer.moment, 1)} mm about the centre of friction`);
  }
  return parts.join(" · ");
}
