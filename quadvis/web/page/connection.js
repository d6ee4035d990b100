// The socket to the gateway: requests and their replies, topics, beats; it connects again by itself.

const AGAIN = 400; // ms until the next attempt

function takeToken() {
  const given = location.hash.slice(1);
  if (given) {
    sessionStorage.setItem("token", given);
    history.replaceState(null, "", location.pathname);
  }
  return sessionStorage.getItem("token") ?? "";
}

export class Connection extends EventTarget {
  #socket = null;
  #token = takeToken();
  #waiting = new Map();
  #next = 1;
  hello = null;
  heard = -Infinity; // performance.now() at which the target was heard of
  dropped = 0;
  refused = "";

  constructor() {
    super();
    this.#connect();
    document.addEventListener("visibilitychange", () => this.#answer());
    addEventListener("online", () => this.#connect());
  }

  /** Ask for a verb; the promise fails with the sentence of the refusal. */
  request(verb, args = {}) {
    if (!this.hello) return Promise.reject(new Error("there is no connection"));
    const id = this.#next++;
    return new Promise((done, failed) => {
      this.#waiting.set(id, { done, failed });
      this.#socket.send(JSON.stringify({ id, verb, args }));
    });
  }

  may(verb) {
    return this.hello?.may.includes(verb) ?? false;
  }

  #connect() {
    if (this.#socket && this.#socket.readyState <= WebSocket.OPEN) return;
    const socket = new WebSocket(`ws://${location.host}/live`);
    socket.binaryType = "arraybuffer";
    socket.onopen = () => socket.send(JSON.stringify({ token: this.#token }));
    socket.onmessage = ({ data }) => this.#take(typeof data === "string" ? JSON.parse(data) : unpack(data));
    socket.onclose = ({ reason, code }) => {
      this.hello = null;
      this.refused = code === 1008 ? reason : "";
      for (const { failed } of this.#waiting.values()) failed(new Error("the connection is lost"));
      this.#waiting.clear();
      this.#emit("lost");
      setTimeout(() => this.#connect(), this.refused ? 10 * AGAIN : AGAIN);
    };
    this.#socket = socket;
  }

  #beat = null;

  /** Answer the newest beat: what came before it is on the screen of somebody who looks. */
  #answer() {
    if (document.visibilityState === "visible" && this.#beat !== null && this.hello) {
      this.#socket.send(JSON.stringify({ beat: this.#beat }));
    }
  }

  #take(message) {
    if ("topic" in message) this.#emit(message.topic.split("/")[0], message);
    else if ("reply" in message) {
      const { done, failed } = this.#waiting.get(message.reply) ?? {};
      this.#waiting.delete(message.reply);
      if (message.ok) done?.(message.bytes ? { ...message.result, [message.bytes]: message.data } : message.result);
      else failed?.(new Error(message.error));
    } else if ("beat" in message) {
      this.#beat = message.beat;
      if (message.heard !== null) this.heard = performance.now() - 1000 * message.heard;
      this.dropped = message.dropped;
      this.#answer();
    } else if ("hello" in message) {
      this.hello = message.hello;
      this.#emit("hello");
    }
  }

  #emit(name, detail) {
    this.dispatchEvent(new CustomEvent(name, { detail }));
  }

  on(name, take) {
    this.addEventListener(name, ({ detail }) => take(detail));
  }
}

/** Return a message of bytes: its head, with samples as Float64Array in `samples`, other bytes in `data`. */
function unpack(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  if ("shape" in head) head.samples = new Float64Array(buffer, 4 + length);
  else head.data = new Uint8Array(buffer, 4 + length);
  return head;
}
