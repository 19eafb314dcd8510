/* The page: a scene that is moved by hand, and the plan that follows it. */

import { Connection } from "./connection.js";
import { centroid, corners, find, html, isCircle, near, place, radians, rounded, say, set, turned, within } from "./geometry.js";
import { Hand } from "./hand.js";
import { keep, linked, packed } from "./link.js";
import { Mechanics } from "./mechanics.js";
import { Model } from "./model.js";
import { Panel } from "./panel.js";
import { Player } from "./player.js";
import { Feedback, ManyRuns, Recordings, Run, csv } from "./runs.js";
import { Table, newOutline } from "./table.js";

const model = new Model(), connection = new Connection(new URLSearchParams(location.search).get("token") || "");
model.addEventListener("changed", ({ detail: { stamp, drag } }) => connection.plan(model.scene, stamp, drag));   /* it is planned while the page is drawn */
const table = new Table(model, connection), player = new Player(model), panel = new Panel(model, player);
const hand = table.hand = new Hand(model, table, connection);
const mechanics = new Mechanics(model, table, connection, player);
const run = table.run = new Run(model, player), feedback = table.feedback = new Feedback(model, connection, player, run), many = new ManyRuns(model, connection), recordings = new Recordings(model, run);
feedback.changed = () => { player.paused = feedback.on ? () => feedback.pause() : null; show(); };
player.moved = () => mechanics.follow();
const state = { run, feedback, many, recordings, mechanics, latencies: table.latencies, hand, model, table, player, connection, busy: false, answered: 0 };
window.flatpush = state;   /* for whoever measures and tests */

/* ---- messages of the server ---- */

let note = 0, starting = false;   /* whether it is told that the planner is starting */

function banner(text, calm = false, seconds = 0) {
  clearTimeout(note);
  const node = find("banner");
  node.hidden = !text;
  node.textContent = text;
  node.classList.toggle("calm", calm);
  if (seconds) note = setTimeout(() => banner(""), 1000 * seconds);
}

connection.addEventListener("hello", async (event) => {
  const { scene, words, runs } = event.detail;
  state.words = words;
  banner("");
  if (model.scene) { connection.again(); return; }
  let first = scene;
  try {
    first = await linked() || scene;
  } catch {
    banner("The scene in this link cannot be read; this is the one that was opened.", false, 8);
  }
  model.load(first, false);
  recordings.take(runs);
  setTimeout(() => { if (!state.answered && find("banner").hidden) { banner("The planner is starting. The first plan follows.", true); starting = true; } }, 1500);
});

connection.addEventListener("closed", () => banner("The connection is lost; trying again … The scene is not lost: it stands in the link in the address bar."));
connection.addEventListener("lost", () => { banner("The planner ended and begins anew.", false, 5); setTimeout(() => connection.again(), 300); });
connection.addEventListener("error", (event) => banner(event.detail.reason, false, 10));
connection.addEventListener("compiling", (event) => {
  const { what, done, of, over } = event.detail;
  /* The next kernel often follows at once: the banner stays a moment, so that the page does not jump. */
  banner(`Compiling ${what}, ${Math.min(done + 1, of)} of ${of} (once on this machine).${state.answered ? "" : " The first plan follows."}`, true, over ? 1.5 : 0);
});
connection.addEventListener("done", () => { state.busy = false; });

connection.addEventListener("plan", (event) => {
  const plan = event.detail, arrived = plan.stamp;
  if (plan.sketch) {
    plan.traces.forEach((trace, k) => { trace.colour = state.words.pushes[k % state.words.pushes.length]; });
    model.plan = plan;
  } else if (plan.status === "solved") {
    plan.traces.forEach((trace, k) => { trace.colour = state.words.pushes[k % state.words.pushes.length]; });
    const { motion } = plan;
    plan.transits = motion.segments.map((segment, k) => ({ segment, k })).filter(({ segment }) => segment.push === null).map(({ k }) => motion.pusher.filter((_, i) => motion.segment[i] === k));
    model.plan = plan;
  } else if (plan.status === "refused" && model.plan && model.plan.traces) {
    model.plan = { ...model.plan, ...plan, stale: true, sketch: false, places: [] };   /* the last path stays, pale */
  } else model.plan = plan;
  if (starting) { starting = false; banner(""); }
  many.clear();
  panel.tell(plan);
  if (plan.sketch) player.sketch(plan.ends); else player.take(plan.status === "solved" ? plan : null);
  if (!table.touched && !state.answered) table.fit(); else table.drawPlan();
  if (model.scene.goal[2] === "free") table.drawScene();
  state.answered += 1;
  if (arrived) requestAnimationFrame(() => setTimeout(() => table.latencies.push(performance.now() - arrived)));
});

connection.addEventListener("file", (event) => {
  const answer = event.detail;
  if (answer.runs) {
    feedback.stop();
    recordings.take(answer.runs);
    banner(`${answer.name}: ${answer.runs.length} recorded run` + (answer.runs.length === 1 ? "" : "s"), true, 6);
    return;
  }
  if (answer.scene) model.load(answer.scene);
  else {
    model.change((scene) => newOutline(scene, answer.outline, answer.name.replace(/\.[^.]*$/, "")));
    table.touched = false;
    table.fit();
  }
  banner(`${answer.name}: ` + (answer.scene ? "opened" : `${answer.outline.length} corners` + (answer.left_out ? `, ${answer.left_out} other parts left out` : "")), true, 6);
});

connection.addEventListener("saved", (event) => download(event.detail.name, event.detail.text));

function download(name, text) {
  const address = URL.createObjectURL(new Blob([text]));
  const link = html("a", { href: address, download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(address), 10000);
}

/* ---- the scene has changed ---- */

model.addEventListener("changed", () => {
  state.busy = true;
  if (feedback.on) { feedback.stop(); feedback.tell("The scene was changed, and the run ended."); }
  run.hide();
  keep(model.scene);
  show();
});
model.addEventListener("selected", () => { table.drawPlan(); show(); });

function show() {
  find("remove").disabled = !model.selected.startsWith("obstacle:");
  find("draw").classList.toggle("on", Boolean(table.sketch));
  find("push").classList.toggle("on", hand.on);
  set(find("push"), { "aria-pressed": String(hand.on) });
  find("here").hidden = !hand.on;
  say(find("follow"), feedback.on ? "Stop" : "Follow");
  find("follow").classList.toggle("on", feedback.on);
  find("back").hidden = feedback.on || !run.motion;
  say(find("play"), feedback.on ? (feedback.paused ? "Go on" : "Pause") : player.playing ? "Pause" : "Play");
  if (feedback.on) find("play").disabled = false;
}

/* ---- what one can do ---- */

function addObstacle() {
  const { x, y, unit } = table.view, half = rounded(Math.min(table.wide, table.high) * unit * 0.06, 1);
  const square = ([cx, cy]) => [[cx - half, cy - half], [cx + half, cy - half], [cx + half, cy + half], [cx - half, cy + half]].map((p) => p.map((v) => rounded(v, 1)));
  /* The first place around the middle where it overlaps neither start nor goal nor another obstacle. */
  const outline = corners(model.scene.object.outline), taken = [model.scene.start, model.scene.goal].map((pose) => outline.map((p) => place(radians(pose), p)));
  taken.push(...model.obstacles.map((obstacle) => corners(obstacle)));
  const places = Array.from({ length: 120 }, (_, k) => [x + 0.12 * half * k * Math.cos(2.4 * k), y + 0.12 * half * k * Math.sin(2.4 * k)]);
  const free = places.find((at) => taken.every((line) => !near(square(at), line, 0.1 * half))) || [x, y];
  const count = model.obstacles.length;
  model.change((scene) => {
    scene.workspace = scene.workspace || {};
    (scene.workspace.obstacles = scene.workspace.obstacles || []).push(square(free));
  });
  model.select(`obstacle:${count}`);
  const node = find("obstacles").lastChild;
  if (node) node.focus({ preventScroll: true });
}

function remove() {
  if (!model.selected.startsWith("obstacle:")) return;
  const k = Number(model.selected.split(":")[1]);
  model.select("");
  model.change((scene) => { scene.workspace.obstacles.splice(k, 1); });
}

function nudge(dx, dy, repeat) {
  const name = model.selected, gesture = repeat ? `nudge ${name}` : "";
  if (name === "start" || name === "goal") {
    model.change((scene) => { scene[name] = [rounded(scene[name][0] + dx, 4), rounded(scene[name][1] + dy, 4), scene[name][2]]; }, gesture);
    return true;
  }
  if (!name.startsWith("obstacle:")) return false;
  const k = Number(name.split(":")[1]), moved = ([x, y]) => [rounded(x + dx, 4), rounded(y + dy, 4)];
  model.change((scene) => {
    const old = scene.workspace.obstacles[k];
    scene.workspace.obstacles[k] = isCircle(old) ? { ...old, centre: moved(old.centre) } : old.map(moved);
  }, gesture);
  return true;
}

function turn(degrees) {
  const name = model.selected;
  if (feedback.on) { if (feedback.pose) { const [x, y, angle] = feedback.pose; feedback.shove([x, y, angle + degrees * Math.PI / 180]); } return; }
  if (name === "start" || (name === "goal" && model.scene.goal[2] !== "free"))
    model.change((scene) => { scene[name] = turned(scene[name], scene.object.outline, degrees); });
  else if (name.startsWith("obstacle:")) {
    const k = Number(name.split(":")[1]), angle = degrees * Math.PI / 180;
    model.change((scene) => {
      const old = scene.workspace.obstacles[k];
      if (isCircle(old)) return;
      const [x, y] = centroid(old), c = Math.cos(angle), s = Math.sin(angle);
      scene.workspace.obstacles[k] = old.map((p) => [rounded(x + c * (p[0] - x) - s * (p[1] - y), 4), rounded(y + s * (p[0] - x) + c * (p[1] - y), 4)]);
    });
  }
}

async function open(file) {
  if (file.size > 2000000) { banner(`${file.name} is larger than 2 MB.`, false, 8); return; }
  const value = { name: file.name };
  if (/\.(csv|mcap|txt)$/i.test(file.name)) value.scene = model.scene;
  if (file.name.toLowerCase().endsWith(".png")) {
    value.pixel = await pixel(file.name);
    if (!value.pixel) return;
  }
  const bytes = new Uint8Array(await file.arrayBuffer());
  let text = "";
  for (const byte of bytes) text += String.fromCharCode(byte);
  connection.send("file", { ...value, data: btoa(text) });
}

function pixel(name) {
  const dialog = find("pixel");
  find("pixelname").textContent = name;
  dialog.returnValue = "";
  dialog.showModal();
  return new Promise((resolve) => dialog.addEventListener("close", () => resolve(dialog.returnValue === "ok" ? find("pixelsize").valueAsNumber : 0), { once: true }));
}

async function save(what) {
  if (what === "run") {
    const name = model.scene.object.name;
    if (hand.rows.length) download("pushed-by-hand.csv", csv(hand.motion, name));
    else if (run.motion) download("run.csv", csv(run.motion, name));
    else banner("Nothing has been pushed by hand or followed yet.", true, 5);
    return;
  }
  if (what !== "link") { connection.send("save", { what, scene: model.scene }); return; }
  const link = location.href.split("#")[0] + "#s=" + await packed(model.scene);
  try {
    await navigator.clipboard.writeText(link);
    banner("The link is copied.", true, 4);
  } catch {
    location.hash = link.split("#")[1];
    banner("The link stands in the address bar.", true, 4);
  }
}

function push(on = !hand.on) {
  if (table.sketch) table.cancel();
  player.play(false);
  feedback.stop();
  hand.turn(on);
  show();
}

function unfold(name) {
  find(name).open = true;
  find(name).scrollIntoView({ block: "nearest" });
}

const clicks = {
  push: () => push(),
  here: () => {
    const [x, y, angle] = hand.pose();
    model.change((scene) => { scene.start = [rounded(x, 2), rounded(y, 2), within(rounded(angle, 2))]; });
    push(false);
  },
  follow: () => {
    unfold("feedback");
    if (feedback.on) { feedback.stop(); feedback.tell("Stopped."); return; }
    hand.turn(false); many.clear();
    feedback.start();
  },
  back: () => { run.hide(); feedback.tell(""); show(); },
  runs: () => { unfold("many"); many.start(); }, runsclear: () => many.clear(),
  undo: () => model.undo(), redo: () => model.redo(), add: addObstacle, remove,
  draw: () => { hand.turn(false); if (table.sketch) table.cancel(); else table.begin(); show(); },
  open: () => find("file").click(), help: () => find("keys").showModal(),
  nearer: () => table.zoom(0.8), further: () => table.zoom(1.25), fit: () => { table.touched = false; table.fit(); },
};
for (const id in clicks) find(id).addEventListener("click", clicks[id]);
find("file").addEventListener("change", (event) => { if (event.target.files[0]) open(event.target.files[0]); event.target.value = ""; });
find("save").addEventListener("change", (event) => { save(event.target.value); event.target.value = ""; });

/* ---- keys ---- */

const KEYS = [
  ["Space", "play or pause"], ["← → ↑ ↓", "nudge what is selected by 1 mm, with Shift 10 mm; else step in time"], ["R", "turn what is selected by 15°, with Shift back; with Alt 1°"],
  [", .", "previous or next segment"], ["Home End", "begin or end of the plan"], ["A", "add an obstacle"], ["Delete", "remove the selected obstacle"], ["P", "push by hand: the pointer is a finger; Escape ends it"], ["C", "follow the plan under feedback, or stop; meanwhile the arrows and R move the object"], ["M", "200 runs that differ a little"], ["D", "draw the outline of the object; Enter closes it, Escape gives up"],
  ["Tab", "select the next thing on the table"], ["F", "show everything"], ["+ −", "nearer, further away"], ["Ctrl Z", "undo"], ["Ctrl Shift Z", "redo"], ["?", "these keys"],
];
find("keylist").append(...KEYS.flatMap(([key, what]) => [html("dt", {}, ...key.split(" ").flatMap((k) => [html("kbd", {}, k), " "])), html("dd", {}, what)]));

const step = () => Math.max(player.duration / 100, 0.02);
const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
const keys = {
  " ": () => { if (feedback.on) feedback.pause(); else player.play(!player.playing); }, c: clicks.follow, m: clicks.runs, Home: () => player.show(0), End: () => player.show(player.duration), ",": () => player.jump(false), ".": () => player.jump(true),
  a: addObstacle, p: clicks.push, d: clicks.draw, f: clicks.fit, "+": clicks.nearer, "=": clicks.nearer, "-": clicks.further, "?": clicks.help, Delete: remove, Backspace: remove,
  Enter: () => { if (table.sketch) { table.finish(); show(); } }, Escape: () => { if (table.sketch) { table.cancel(); show(); } else if (feedback.on) clicks.follow(); else if (hand.on) push(false); else if (run.motion) clicks.back(); else if (many.told) many.clear(); else model.select(""); },
};

document.addEventListener("keydown", (event) => {
  if (document.querySelector("dialog[open]") || !model.scene) return;
  const control = event.ctrlKey || event.metaKey, field = event.target.matches("input[type=number], select");
  if (control && event.key.toLowerCase() === "z" && !field) { event.preventDefault(); if (event.shiftKey) model.redo(); else model.undo(); return; }
  if (control && event.key.toLowerCase() === "y" && !field) { event.preventDefault(); model.redo(); return; }
  if (control || event.key === "Tab") return;
  if (field || event.target.matches("input[type=range], input[type=checkbox]")) return;
  if (event.target.matches("button, summary") && (event.key === " " || event.key === "Enter")) return;
  const arrow = arrows[event.key];
  if (arrow) {
    event.preventDefault();
    const far = event.shiftKey ? 10 : 1;
    if (feedback.on) { const [x, y, angle] = feedback.pose || [0, 0, 0]; feedback.shove([x + far * arrow[0], y + far * arrow[1], angle]); return; }
    if (!nudge(far * arrow[0], far * arrow[1], event.repeat) && arrow[0]) player.show(player.now + arrow[0] * step());
    return;
  }
  if (event.key.toLowerCase() === "r") { event.preventDefault(); turn((event.shiftKey ? -1 : 1) * (event.altKey ? 1 : 15)); return; }
  const act = keys[event.key] || keys[event.key.toLowerCase()];
  if (!act || (event.repeat && event.key === " ")) return;
  event.preventDefault();
  act();
});

/* ---- files that are dropped ---- */

document.addEventListener("dragover", (event) => { event.preventDefault(); document.body.classList.add("dropping"); });
document.addEventListener("dragleave", (event) => { if (!event.relatedTarget) document.body.classList.remove("dropping"); });
document.addEventListener("drop", (event) => {
  event.preventDefault();
  document.body.classList.remove("dropping");
  if (event.dataTransfer.files[0]) open(event.dataTransfer.files[0]);
});

window.addEventListener("hashchange", async () => {
  try {
    const scene = await linked();
    if (scene && JSON.stringify(scene) !== JSON.stringify(model.scene)) model.load(scene);
  } catch {
    banner("The scene in this link cannot be read.", false, 8);
  }
});

show();
