/* The plan in motion: a timeline to scrub and to play. */

import { RAD, centroid, corners, find, html, number, path, place, say, set, size, svg } from "./geometry.js";

export class Player {
  constructor(model) {
    this.model = model;
    this.motion = null;      /* what is played: the plan or a run */
    this.planned = this.recorded = this.pushing = null;
    this.live = false;
    this.now = 0; this.playing = false; this.last = 0;
    this.speeds = find("speed");
    find("play").addEventListener("click", () => { if (this.live && this.paused) this.paused(); else this.play(!this.playing); });
    find("scrub").addEventListener("input", (event) => { this.play(false); this.show(this.duration * event.target.value / 1000); });
  }

  get duration() { return this.motion ? this.motion.times[this.motion.times.length - 1] : 0; }

  /* Takes the motion of a plan; the time stays where it was, and at the end if it was there. */
  take(plan) {
    const ended = this.motion && this.now > 0 && this.now >= this.duration;
    this.planned = plan && plan.motion ? plan.motion : null;
    if (this.recorded) return;
    if (ended && this.planned) this.now = this.planned.times[this.planned.times.length - 1];
    this.use(this.planned);
  }

  /* While something is dragged only where it begins and ends is known; in between nothing is shown meanwhile. */
  sketch([first, last]) {
    if (this.recorded) return;
    this.play(false);
    const end = this.now <= 0 ? first : this.now >= this.duration ? last : null, moving = find("moving");
    moving.style.display = end ? "" : "none";
    if (!end) return;
    this.put(end.object, end.pusher, end.height, end.tips);
    if (this.moved) this.moved();
  }

  put(object, pusher, height, tips) {
    set(find("object"), { transform: `translate(${object[0]} ${object[1]}) rotate(${object[2] / RAD})` });
    const placed = pusher ? tips.map((tip) => place(pusher, tip)) : [];
    find("pusher").classList.toggle("lifted", height > 1e-3);
    document.querySelectorAll("#pusher .tip").forEach((disc, k) => {
      disc.style.display = k < placed.length ? "" : "none";
      if (k < placed.length) set(disc, { cx: placed[k][0], cy: placed[k][1] });
    });
    set(document.querySelector("#pusher .bar"), { d: placed.length > 1 ? path(placed, false) : "" });
  }

  /* Plays a run instead of the plan, from its end if it is under way; null: the plan again. */
  record(motion, live = false, ended = live) {
    const last = this.recorded;
    this.recorded = motion;
    if (!motion && !last) return;
    this.live = live;
    this.now = motion && ended ? motion.times[motion.times.length - 1] : 0;
    if (live && last === motion) { this.strip(); this.show(this.now); return; }
    this.play(false);
    this.use(motion || this.planned);
  }

  use(motion) {
    this.motion = motion;
    find("moving").style.display = this.motion ? "" : "none";
    const live = Boolean(this.recorded && this.live), empty = !this.motion || !this.motion.segments.length;
    find("scrub").disabled = empty || live;
    find("play").disabled = empty && !live;
    if (!this.motion) { this.play(false); find("strip").replaceChildren(); find("time").textContent = "–"; find("mode").textContent = ""; return; }
    const { scene } = this.model, middle = centroid(scene.object.outline);
    find("object").replaceChildren(
      svg("path", { class: "body", d: path(corners(scene.object.outline)) }),
      svg("path", { class: "mark", d: `M${middle[0]} ${middle[1]}h${0.18 * size(scene.object.outline)}` }));
    for (const tip of document.querySelectorAll("#pusher .tip")) set(tip, { r: Math.max(scene.pusher.tip_radius, 0.008 * size(scene.object.outline)) });
    this.strip();
    this.show(this.now);
  }

  strip() {
    const strip = find("strip"), all = this.motion.segments;
    while (strip.children.length > all.length) strip.lastChild.remove();
    while (strip.children.length < all.length) strip.append(html("span"));
    all.forEach((segment, k) => {
      const end = k + 1 < all.length ? all[k + 1].start : this.duration, part = strip.children[k];
      part.style.flex = (end - segment.start) + " 0 0";
      part.style.background = segment.push === null ? "transparent" : segment.colour;
    });
  }

  /* The sample after the time t; where two segments meet, of the later one. */
  after(t) {
    const times = this.motion.times;
    let low = 0, high = times.length - 1;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (times[middle] > t) high = middle; else low = middle + 1;
    }
    return low;
  }

  state(t) {
    const { times, object, pusher, height, segments, segment } = this.motion;
    const b = this.after(t), a = Math.max(b - 1, 0), span = times[b] - times[a];
    const s = span > 0 ? Math.min((t - times[a]) / span, 1) : 1;
    const mix = (rows) => rows[a].map((v, k) => (1 - s) * v + s * rows[b][k]);
    return { object: mix(object), pusher: pusher.length ? mix(pusher) : null, height: (1 - s) * height[a] + s * height[b], segment: segments[segment[b]] || null };
  }

  show(t) {
    if (!this.motion) return;
    this.now = Math.min(Math.max(t, 0), this.duration);
    const { object, pusher, height, segment } = this.state(this.now);
    const pushing = segment && segment.push !== null;
    const turn = pushing ? segment.turns.find((part) => this.now < part.end) || segment.turns[segment.turns.length - 1] : null;
    find("table").style.setProperty("--now", pushing ? `color-mix(in oklab, ${segment.colour}, white var(--lift))` : "var(--ink)");
    this.put(object, segment ? pusher : null, height, segment ? segment.tips : []);
    const flat = pushing && segment.flat ? place(object, segment.flat) : null;
    find("point").style.display = flat ? "" : "none";
    if (flat) set(find("point"), { cx: flat[0], cy: flat[1] });
    const centre = turn && turn.centre, node = find("centre");
    node.style.display = centre ? "" : "none";
    if (centre) {
      const from = flat || object, [line, circle, sign] = node.children, unit = parseFloat(find("table").style.getPropertyValue("--u")) || 1, d = 4.2 * unit;
      set(line, { x1: from[0], y1: from[1], x2: centre[0], y2: centre[1] });
      set(circle, { cx: centre[0], cy: centre[1] });
      const at = (x, y) => (centre[0] + x) + " " + (centre[1] + y);
      set(sign, { d: "M" + at(-d, 0) + "L" + at(d, 0) + (turn.turn === "left" ? "M" + at(0, -d) + "L" + at(0, d) : "") });
    }
    say(find("time"), number(this.now, 2) + " s of " + number(this.duration, 2) + " s");
    say(find("mode"), describe(segment, turn, height));
    find("scrub").value = this.duration > 0 ? 1000 * this.now / this.duration : 0;
    set(find("scrub"), { "aria-valuetext": find("time").textContent + ", " + find("mode").textContent });
    this.pushing = pushing && turn ? { push: segment.number - 1, arc: segment.turns.indexOf(turn) } : null;
    this.dispatch(segment);
    if (this.moved) this.moved();
  }

  dispatch(segment) {
    const number = segment && segment.push !== null ? segment.number - 1 : -1;
    document.querySelectorAll("#pushes button").forEach((button, k) => set(button, { "aria-current": String(k === number) }));
  }

  /* To the beginning of the push with this number, from 0. */
  jumpTo(k) {
    const segment = this.motion && this.motion.segments.find((part) => part.push !== null && part.number === k + 1);
    if (segment) { this.play(false); this.show(segment.start); }
  }

  jump(forwards) {
    if (!this.motion) return;
    const starts = this.motion.segments.map((segment) => segment.start).concat(this.duration);
    const next = forwards ? starts.find((s) => s > this.now + 1e-6) : starts.filter((s) => s < this.now - 1e-6).pop();
    if (next !== undefined) this.show(next);
  }

  play(yes) {
    this.playing = yes && this.duration > 0;
    if (!this.live) say(find("play"), this.playing ? "Pause" : "Play");
    if (!this.playing) return;
    if (this.now >= this.duration) this.show(0);
    this.last = performance.now();
    requestAnimationFrame((clock) => this.tick(clock));
  }

  tick(clock) {
    if (!this.playing) return;
    this.show(this.now + Math.max(clock - this.last, 0) / 1000 * Number(this.speeds.value));
    this.last = clock;
    if (this.now >= this.duration) this.play(false); else requestAnimationFrame((next) => this.tick(next));
  }
}

function describe(segment, turn, height) {
  if (!segment) return "at rest";
  if (segment.text) return segment.text;
  if (segment.push === null) return height > 1e-3 ? "pusher lifted " + number(height, 0) + " mm" : "pusher alone, on the table";
  return "push " + segment.number + " “" + segment.push + "”, " + (!turn ? "sliding" : turn.turn === "straight" ? "straight" : "turning " + turn.turn);
}
