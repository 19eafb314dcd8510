/* Runs of a plan beside the plan: followed under feedback, recorded by a robot, or many that differ a little. */

import { centroid, corners, find, html, number, path, place, set } from "./geometry.js";

/* One run on the table: the way of the object's middle, and a motion that the player plays. */
export class Run {
  constructor(model, player) {
    this.model = model; this.player = player;
    this.motion = null;
  }

  /* From its begin, or where it has just ended. */
  show(motion, ended = false) {
    this.motion = motion;
    this.player.record(motion, false, ended);
    this.draw();
  }

  hide() {
    if (!this.motion) return;
    this.motion = null;
    this.player.record(null);
    this.draw();
  }

  draw() {
    const node = find("run");
    if (!this.motion) { set(node, { d: "" }); return; }
    const middle = centroid(this.model.scene.object.outline);
    set(node, { d: path(this.motion.object.map((pose) => place(pose, middle)), false) });
  }
}

/* The run as a table that flatpush replay reads. */
export function csv(motion, name) {
  const tidy = name.replace(/[,"\n]/g, " ");
  let last = -1;
  const rows = motion.times.map((t, k) => {
    if (motion.height[k] > 0.5 || t <= last) return "";
    last = t;
    const segment = motion.segments[motion.segment[k]];
    return [tidy, "", "", t.toFixed(6), ...motion.object[k].map((v) => v.toFixed(6)), ...motion.pusher[k].map((v) => v.toFixed(6)), segment.action || 0, 0, segment.contact || ""].join(",") + "\n";
  });
  return "object,start_id,run_id,t,obj_x_mm,obj_y_mm,obj_theta_rad,pusher_x_mm,pusher_y_mm,pusher_theta_rad,action_id,vision_lost,contact\n" + rows.join("");
}

/* The plan followed by a controller that sees through a camera; the object can be moved by hand meanwhile. */
export class Feedback {
  constructor(model, connection, player, run) {
    this.model = model; this.connection = connection; this.player = player; this.run = run;
    this.on = false; this.paused = false; this.waiting = false;
    this.seed = 0;        /* of the camera's noise in the next run */
    connection.addEventListener("follows", () => { this.waiting = false; this.last = performance.now(); this.tick(); });
    connection.addEventListener("followed", (event) => this.followed(event.detail));
    connection.addEventListener("refused", (event) => { if (event.detail.number === this.number) this.end(event.detail.reason); });
    connection.addEventListener("closed", () => this.end("The connection was lost, and with it this run."));
    connection.addEventListener("lost", () => this.end("The planner ended, and with it this run."));
  }

  value(id) { return find(id).valueAsNumber; }

  start() {
    const { plan } = this.model;
    const push = plan && plan.status === "solved" && plan.motion && plan.motion.segments.find((segment) => segment.push !== null);
    if (!push) { this.tell("There is no plan with a push to follow.", true); return; }
    this.on = true; this.paused = false; this.waiting = true; this.moved = null;
    this.tips = push.tips;
    this.run.hide();
    document.body.classList.add("following");
    this.live = { times: [], object: [], pusher: [], height: [], segment: [], segments: [] };
    this.tell("");
    this.number = this.connection.send("follow", {
      controller: find("controller").value, delay: this.value("camera-delay"), frames: this.value("camera-frames"),
      noise: [this.value("camera-noise"), this.value("camera-turn")], learn: find("learn").checked, seed: this.seed++,
    });
    this.changed();
  }

  /* Ends it; what was done stays to be played. */
  stop() {
    if (!this.on) return;
    this.on = false;
    document.body.classList.remove("following");
    find("seen").style.display = "none";
    this.changed();
    if (this.live.times.length > 1) this.run.show(this.live, true); else this.run.hide();
  }

  end(why) { if (this.on) { this.stop(); this.tell(why, true); } }

  get pose() { return this.live && this.live.object.length ? this.live.object[this.live.object.length - 1] : null; }

  /* Somebody moves the object. */
  shove(pose) { if (this.on && this.pose) this.moved = pose; }

  pause() { this.paused = !this.paused; this.last = performance.now(); this.changed(); }

  tick() {
    if (!this.on) return;
    requestAnimationFrame(() => this.tick());
    const now = performance.now();
    if (this.waiting || this.paused || now - this.last < 15) return;
    this.waiting = true;
    const seconds = Math.min(Math.max((now - this.last) / 1000 * Number(find("speed").value), 0.017), 0.5);
    this.last = now;
    this.number = this.connection.send("on", { seconds, moved: this.moved });
    this.moved = null;
  }

  followed(answer) {
    if (!this.on) return;
    this.waiting = false;
    const { live } = this, text = `${answer.mode}, ${answer.contact}`;
    const last = live.segments[live.segments.length - 1];
    if (!last || last.text !== text)
      live.segments.push({ start: live.times.length ? live.times[live.times.length - 1] : 0, push: answer.touches ? answer.contact : null, number: 0, action: answer.touches ? 1 : 0, colour: answer.colour, text, contact: answer.contact, flat: null, turns: [], tips: this.tips });
    for (const [t, x, y, angle, hx, hy, yaw, height] of answer.rows) {
      if (live.times.length && t <= live.times[live.times.length - 1]) continue;
      live.times.push(t); live.object.push([x, y, angle]); live.pusher.push([hx, hy, yaw]); live.height.push(height); live.segment.push(live.segments.length - 1);
    }
    this.run.motion = live;
    this.player.record(live, true);
    this.run.draw();
    const { seen } = answer, ghost = find("seen");
    ghost.style.display = seen ? "" : "none";
    if (seen) set(ghost, { d: path(corners(this.model.scene.object.outline).map((p) => place(seen, p))) });
    const landed = answer.landings < 2 ? "" : answer.outcome ? `, with ${answer.landings} landings` : `, landing ${answer.landings}`;
    this.tell(answer.outcome ? `${answer.outcome[0].toUpperCase()}${answer.outcome.slice(1)} after ${number(live.times[live.times.length - 1], 1)} s${landed}.` : `${text}${landed}`);
    this.moves = answer.landings;
    if (answer.outcome) this.stop();
  }

  tell(text, bad = false) {
    find("followed").textContent = text;
    find("followed").classList.toggle("bad", bad);
  }
}

/* Many runs from about the same start: the tube in which the object stays, and where it ends. */
export class ManyRuns {
  constructor(model, connection) {
    this.model = model; this.connection = connection;
    this.told = null; this.number = 0;
    connection.addEventListener("refused", (event) => { if (event.detail.number === this.number) { this.clear(); find("runsdone").textContent = event.detail.reason; } });
    for (const end of ["lost", "closed"]) connection.addEventListener(end, () => { if (this.number && !(this.told && this.told.done === this.told.count)) this.clear(); });
    connection.addEventListener("runs", (event) => { if (event.detail.number === this.number) { this.told = event.detail; this.draw(); } });
  }

  start() {
    const value = (id) => find(id).valueAsNumber;
    this.clear();
    this.number = this.connection.send("runs", { count: 200, seed: 0, position: value("runs-position"), angle: value("runs-angle"), friction: value("runs-friction") });
    find("runsdone").textContent = "The first ones are on their way.";
  }

  clear() { if (!this.number) return; this.number = 0; this.told = null; this.draw(); }

  draw() {
    const { told } = this, tube = find("tube"), table = find("runserrors");
    find("runsdone").textContent = told ? `${told.done} of ${told.count} runs: ${number(100 * told.sticking, 0)} % stuck to the end` + rest(told) : "";
    find("runsbar").value = told ? told.done / told.count : 0;
    find("runsbar").hidden = !told || told.done === told.count;
    if (!told) { tube.replaceChildren(); table.replaceChildren(); return; }
    const outline = corners(this.model.scene.object.outline);
    const ns = (d, kind, opacity = "") => { const node = document.createElementNS("http://www.w3.org/2000/svg", "path"); set(node, { d, class: kind }); if (opacity) node.style.fillOpacity = opacity; return node; };
    tube.replaceChildren(ns(told.ends.map((pose) => path(outline.map((p) => place(pose, p)))).join(""), "end-of-run"), ...told.bands.map(({ ring, opacity }) => ns(path(ring), "band", opacity)));
    const digits = (v) => (v >= 0.005 || v === 0 ? number(v, 2) : "<0.01");
    table.replaceChildren(...told.errors.map(({ name, distance, turn }) => html("tr", {}, html("th", { scope: "row" }, name), html("td", {}, `${digits(distance)} mm`), html("td", {}, `${digits(turn)}°`))));
  }
}

function rest(told) {
  const others = Object.entries(told.outcomes).filter(([name]) => name !== "completed");
  return others.length ? "; " + others.map(([name, count]) => `${count} ${name}`).join(", ") : "";
}

/* Runs that a robot recorded; one is chosen. */
export class Recordings {
  constructor(model, run) {
    this.model = model; this.run = run;
    this.runs = [];
    find("recording").addEventListener("change", (event) => this.choose(Number(event.target.value)));
  }

  take(runs) {
    this.runs = runs;
    find("recordings").hidden = !runs.length;
    find("recording").replaceChildren(...runs.map((run, k) => html("option", { value: k }, run.name)));
    if (runs.length) this.choose(0);
  }

  choose(k) {
    find("recording").value = String(k);
    find("recordingended").textContent = this.runs[k].outcome ? `It ended: ${this.runs[k].outcome}.` : "";
    this.run.show(this.runs[k].motion);
  }
}

