/* The scene that is edited: its document in mm and degrees, and what was before. */

const MOST = 200;  /* scenes that can be brought back */

export class Model extends EventTarget {
  constructor() {
    super();
    this.scene = null;
    this.plan = null;      /* the last answer that is a plan, or none */
    this.selected = "";    /* start, goal, obstacle:2, push:0 or nothing */
    this.before = []; this.after = [];
    this.gesture = "";
  }

  /* Takes a whole scene; with keep it can be undone. */
  load(scene, keep = true) {
    if (keep && this.scene) this.remember("");
    this.scene = scene;
    this.select("");
    this.dispatchEvent(new CustomEvent("loaded"));
    this.changed();
  }

  /* Changes a copy of the scene; changes of one gesture, which has a name of its own, are undone together. */
  change(edit, gesture = "", stamp = 0) {
    const next = structuredClone(this.scene);
    edit(next);
    if (JSON.stringify(next) === JSON.stringify(this.scene)) return;
    this.remember(gesture);
    this.scene = next;
    this.changed(stamp, Boolean(gesture));
  }

  remember(gesture) {
    if (!gesture || gesture !== this.gesture) {
      this.before.push(this.scene);
      if (this.before.length > MOST) this.before.shift();
      this.after = [];
    }
    this.gesture = gesture;
  }

  undo() { this.travel(this.before, this.after); }

  redo() { this.travel(this.after, this.before); }

  travel(from, to) {
    if (!from.length) return;
    to.push(this.scene);
    this.scene = from.pop();
    this.gesture = "";
    const chosen = this.selected.split(":");
    if (chosen[0] === "obstacle" && Number(chosen[1]) >= this.obstacles.length) this.select("");
    this.changed();
  }

  get obstacles() { return (this.scene.workspace || {}).obstacles || []; }

  changed(stamp = 0, drag = false) { this.dispatchEvent(new CustomEvent("changed", { detail: { stamp, drag } })); }

  select(item) {
    if (item === this.selected) return;
    this.selected = item;
    this.dispatchEvent(new CustomEvent("selected"));
  }
}
