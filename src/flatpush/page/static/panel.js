/* What stands beside the table: the plan in numbers, the poses, and sliders with numbers. */

import { find, html, number, rounded, say } from "./geometry.js";

const MODELS = ["exact", "ellipsoid", "local", "quartic"], COSTS = ["flat", "pusher", "time"];

/* Name, where it is in the scene, least and greatest value of the slider, step, unit. */
const SLIDERS = [
  ["friction", "object.friction", 0, 1, 0.01, "μ"],
  ["finger spacing", "pusher.spacing", 4, 60, 0.5, "mm"],
  ["tip radius", "pusher.tip_radius", 0, 10, 0.1, "mm"],
  ["switching cost", "planning.switch_cost", 0, 100, 1, "mm"],
  ["friction margin", "planning.margin.friction", 0, 0.9, 0.01, "of μ"],
  ["clearance", "planning.margin.clearance", 0, 20, 0.1, "mm"],
];
const CHOICES = [
  ["fingers", "pusher.fingers", [1, 2], ["one", "two"]],
  ["model", "planning.model", MODELS, MODELS],
  ["cost", "planning.cost", COSTS, ["path of the flat point", "path of the pusher", "time"]],
];

const STALE = ["title", "subtitle", "duration", "proved", "strip", "time"];   /* that a sketch does not tell */

const read = (scene, key) => key.split(".").reduce((value, step) => (value === undefined ? undefined : value[step]), scene);

function write(scene, key, value) {
  const steps = key.split("."), last = steps.pop();
  steps.reduce((part, step) => (part[step] = part[step] || {}), scene)[last] = value;
}

export class Panel {
  constructor(model, player) {
    this.model = model; this.player = player;
    this.inputs = [];
    this.poses(); this.sliders();
    model.addEventListener("changed", ({ detail: { stamp } }) => { if (stamp) this.soon(); else this.show(); });
  }

  /* While something is dragged the numbers follow ten times a second: more nobody reads, and to paint them takes as
     long as to paint the table. */
  soon() {
    if (!this.timer) this.timer = setTimeout(() => { this.show(); if (this.model.plan && this.model.plan.sketch) this.sketch(this.model.plan); }, 100);
  }

  poses() {
    for (const name of ["start", "goal"]) {
      const row = html("tr", {}, html("th", { style: `--c:var(--${name})`, scope: "row" }, name));
      ["x", "y", "θ"].forEach((axis, k) => {
        const input = html("input", { type: "number", step: k === 2 ? "1" : "1", inputmode: "decimal", "aria-label": `${name} ${axis} in ${k === 2 ? "degrees" : "mm"}`, id: `${name}${k}` });
        input.addEventListener("input", () => {
          if (!Number.isFinite(input.valueAsNumber)) return;
          this.model.change((scene) => { scene[name][k] = input.valueAsNumber; }, `type ${name}${k}`);
        });
        this.inputs.push([input, (scene) => scene[name][k]]);
        row.append(html("td", {}, input));
      });
      find("poses").append(row);
    }
    const free = html("input", { type: "checkbox", id: "free" });
    free.addEventListener("change", () => this.model.change((scene) => { scene.goal[2] = free.checked ? "free" : 0; }));
    this.free = free;
    find("poses").append(html("tr", {}, html("td"), html("td", { colspan: 3 }, html("label", {}, free, " any angle at the goal"))));
  }

  sliders() {
    const home = find("sliders");
    for (const [name, key, low, high, step, unit] of SLIDERS) {
      const id = key.replaceAll(".", "-"), small = html("small", {}, unit);
      const range = html("input", { type: "range", min: low, max: high, step, "aria-label": `${name}, slider`, id: `${id}-slider` });
      const field = html("input", { type: "number", min: low, step, inputmode: "decimal", id });
      for (const input of [range, field]) {
        input.addEventListener("input", () => {
          if (Number.isFinite(input.valueAsNumber)) this.model.change((scene) => write(scene, key, input.valueAsNumber), `set ${key}`);
        });
      }
      range.addEventListener("change", () => { this.model.gesture = ""; });
      this.inputs.push([range, (scene) => read(scene, key)], [field, (scene) => read(scene, key)]);
      if (key === "planning.switch_cost") this.costUnit = { small, range };
      if (key === "pusher.spacing") this.spacing = [range, field];
      home.append(html("div", { class: "slider" }, html("label", { for: id }, name), range, html("span", { class: "with" }, field, small)));
    }
    for (const [name, key, values, labels] of CHOICES) {
      const id = key.replaceAll(".", "-"), select = html("select", { id }, ...values.map((value, k) => html("option", { value }, labels[k])));
      select.addEventListener("change", () => this.model.change((scene) => {
        const value = values.find((v) => String(v) === select.value);
        write(scene, key, value);
        if (key === "planning.cost") scene.planning.switch_cost = value === "flat" ? 30 : 0;
        if (key === "pusher.fingers" && value === 2) scene.pusher.spacing = Math.max(scene.pusher.spacing || 18, 2 * scene.pusher.tip_radius);
        if (key === "pusher.fingers" && Array.isArray(scene.pushes)) for (const push of scene.pushes) { delete push.fingers; delete push.spacing; }
      }));
      this.inputs.push([select, (scene) => read(scene, key)]);
      home.append(html("div", { class: "slider" }, html("label", { for: id }, name), select));
    }
  }

  /* The scene in the inputs; one that is being typed in stays as it is. */
  show() {
    const { scene } = this.model;
    clearTimeout(this.timer);
    this.timer = 0;
    for (const [input, value] of this.inputs) {
      const shown = value(scene), open = shown === "free" || shown === undefined;
      if (input === document.activeElement && input.type === "number" && !open && input.valueAsNumber === shown) continue;
      input.disabled = shown === "free";
      const text = open ? "" : typeof shown === "number" ? String(rounded(shown, 3)) : shown;
      if (input.value !== text) input.value = text;
    }
    this.free.checked = scene.goal[2] === "free";
    const time = scene.planning.cost === "time";
    say(this.costUnit.small, time ? "s" : "mm");
    this.costUnit.range.max = time ? 10 : 100;
    for (const input of this.spacing) input.disabled = scene.pusher.fingers !== 2;
    find("undo").disabled = !this.model.before.length;
    find("redo").disabled = !this.model.after.length;
  }

  /* The numbers of an answer. */
  tell(plan) {
    const solved = plan.status === "solved";
    if (plan.sketch) { this.soon(); return; }
    document.title = plan.title || `${this.model.scene.object.name}: no plan`;
    for (const id of STALE) find(id).classList.remove("stale");
    say(find("title"), document.title);
    say(find("subtitle"), solved ? plan.subtitle + (plan.stored ? ` · ${plan.stored}` : "") : (plan.reason || "").split("\n")[0]);
    find("subtitle").title = find("subtitle").textContent;   /* whole, where the line is cut off */
    const spent = plan.planning_time;
    say(find("cost"), solved ? plan.cost.split(" (")[0] : "–");
    say(find("duration"), solved ? number(plan.duration, 1) + " s" : "–");
    say(find("count"), solved ? String(plan.traces.length) : "–");
    say(find("spent"), !spent ? (plan.stored ? "stored" : "–") : spent < 1 ? number(1000 * spent, 0) + " ms" : number(spent, 1) + " s");
    find("reason").hidden = solved;
    say(find("reason"), solved ? "" : plan.reason);
    this.list(plan.traces || []);
    const proved = find("proved");
    /* Margins come a moment after the path; the old ones stay meanwhile, pale. */
    if (solved && plan.proved.length) proved.replaceChildren(...plan.proved.flatMap(([name, value]) => [html("dt", {}, name), html("dd", {}, value)]));
    else if (!solved) proved.replaceChildren();
    proved.classList.toggle("stale", solved && !plan.proved.length);
    if (!solved || plan.proved.length) find("warnings").replaceChildren(...(plan.warnings || []).map((text) => html("li", {}, text)));
  }

  /* Of a path while something is dragged: the cost and the pushes; what else is told stays meanwhile, pale. */
  sketch(plan) {
    for (const id of STALE) find(id).classList.add("stale");
    say(find("cost"), plan.cost.split(" (")[0]);
    say(find("count"), String(plan.traces.length));
    say(find("spent"), number(1000 * plan.planning_time, 0) + " ms");
    find("reason").hidden = true;
    find("warnings").replaceChildren();
    this.list(plan.traces);
  }

  /* The pushes, as buttons; while something is dragged they are mostly the same ones. */
  list(traces) {
    const told = JSON.stringify(traces.map(({ name, word, colour }) => [name, word, colour]));
    if (told === this.listed) return;
    this.listed = told;
    find("pushes").replaceChildren(...traces.map((trace, k) => {
      const button = html("button", { type: "button", "data-push": k }, html("i", { style: `--c:${trace.colour}` }, String(k + 1)), html("b", {}, trace.name), html("span", {}, trace.word));
      button.addEventListener("click", () => { this.model.select(`push:${k}`); this.player.jumpTo(k); });
      return html("li", {}, button);
    }));
  }
}
