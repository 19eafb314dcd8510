/* The connection to the server: the newest scene is asked for, and a lost connection is taken up again. */

const PATIENCE = 450;     /* for an answer, before a newer scene is sent all the same [ms] */
const APART = 12;         /* between two requests of one drag: a screen shows no more [ms] */
const MOST = 2900000;     /* bytes of a message */

export class Connection extends EventTarget {
  constructor(token) {
    super();
    this.token = token;
    this.number = 0;
    this.open = false;
    this.asked = null;    /* the request that has no answer yet */
    this.wanted = null;   /* the newest scene that has not been sent */
    this.last = null;     /* the last scene, to be sent again after a break */
    this.wait = 250;
    this.connect();
  }

  connect() {
    this.socket = new WebSocket("ws://" + location.host + "/live?token=" + encodeURIComponent(this.token));
    this.socket.onopen = () => {
      this.open = true; this.wait = 250; this.asked = null;
      this.tell("opened");
    };
    this.socket.onmessage = (event) => this.hear(JSON.parse(event.data));
    this.socket.onclose = () => {
      this.open = false; this.asked = null;
      this.tell("closed");
      setTimeout(() => this.connect(), this.wait);
      this.wait = Math.min(2 * this.wait, 4000);
    };
  }

  tell(name, detail) { this.dispatchEvent(new CustomEvent(name, { detail })); }

  /* Asks for a plan of a scene; one that is asked for meanwhile takes its place. Of a drag the path comes first, and
     the plan once it rests. */
  plan(scene, stamp, drag = false) {
    const text = JSON.stringify(scene);
    if (drag && this.last && this.last.text === text) return;   /* the pointer was heard before the page moved */
    this.wanted = this.last = { scene, stamp, kind: drag ? "drag" : "plan", text };
    this.push();
  }

  again() { if (this.last) { this.wanted = this.last; this.push(); } }

  push() {
    if (!this.wanted || !this.open) return;
    const now = performance.now(), { scene, stamp, kind } = this.wanted;
    const wait = this.asked ? PATIENCE : kind === "drag" ? APART : 0, gone = now - (this.asked || this.current || { at: -1e9 }).at;
    if (gone < wait) {
      clearTimeout(this.timer);
      this.timer = setTimeout(() => this.push(), wait - gone + 1);
      return;
    }
    this.wanted = null;
    this.asked = { number: this.send(kind, scene), at: now, stamp };
    this.current = this.asked;
  }

  send(kind, value) {
    const text = JSON.stringify({ number: ++this.number, kind, value });
    if (text.length > MOST) {
      this.tell("error", { reason: "this is too much for one message: " + Math.round(text.length / 1e5) / 10 + " MB" });
      return this.number;
    }
    if (this.open) this.socket.send(text);
    return this.number;
  }

  hear(message) {
    if (["plan", "done", "superseded"].includes(message.kind)) {
      const current = this.current && message.number === this.current.number;
      if (this.asked && message.number === this.asked.number) {
        this.asked = null;
        if (message.kind === "plan") message.stamp = this.current.stamp;
        if (message.kind === "superseded" && !this.wanted) this.wanted = this.last;
      }
      this.push();   /* before the answer is drawn: the next one is planned meanwhile */
      if (current) this.tell(message.kind, message);
    } else this.tell(message.kind, message);
  }
}
