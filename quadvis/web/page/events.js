// Below: what happened and when; the recordings, to be saved.

import { find, make, save, say, show } from "./dom.js";
import { bytes } from "./format.js";

const MOST = 200; // events that are kept

function words(event) {
  const rest = { ...event };
  for (const known of ["event", "application", "changes", "tick", "time", "text", "problem"]) delete rest[known];
  const changes = (event.changes ?? []).map(({ name, old, new: now }) => `${name}: ${text(old)} \u2192 ${text(now)}`);
  const parts = [event.text ?? event.event, ...changes];
  if (event.tick !== undefined) parts.push(`from tick ${event.tick}`);
  if (event.problem) parts.push(event.problem);
  parts.push(...Object.entries(rest).map(([name, value]) => `${name} ${text(value)}`));
  return parts.filter(Boolean).join(", ");
}

function text(value) {
  if (value && typeof value === "object" && !Array.isArray(value)) return `${text(value.value)} ${value.unit ?? ""}`.trim();
  return Array.isArray(value) ? `[${value.map(text).join(", ")}]` : String(value);
}

export class Events {
  constructor(connection, onrefusal) {
    Object.assign(this, { connection, onrefusal });
    this.list = find("#events ol");
    this.logs = find("#logs");
  }

  add(event, local = false) {
    const clock = new Date().toLocaleTimeString("en-GB");
    const kind = /overload|lost|safe/.test(event.event) || event.problem ? "bad" : "";
    this.list.prepend(make("li", { className: local ? "local" : kind }, make("time", { textContent: clock }), words(event)));
    while (this.list.children.length > MOST) this.list.lastChild.remove();
  }

  /** List the recordings. */
  async begin() {
    const may = this.connection.may("logs");
    const logs = may ? await this.connection.request("logs") : [];
    show(this.logs, logs.length > 0);
    find("ul", this.logs).replaceChildren(...logs.toReversed().slice(0, 50).map(({ name, bytes: size, size: other }) => {
      const button = make("button", { type: "button", className: "plain", textContent: name, title: "save this recording" });
      button.onclick = () => this.#save(name, button);
      return make("li", {}, button, make("small", { textContent: bytes(size ?? other ?? 0) }));
    }));
  }

  async #save(name, button) {
    const pieces = [];
    let size = 0;
    button.disabled = true;
    try {
      for (;;) {
        const piece = await this.connection.request("getlog", { name, offset: size });
        pieces.push(new Blob([piece.data]));
        size += piece.data.length;
        say(button, `${name}: ${Math.round((100 * size) / Math.max(1, piece.size))} %`);
        if (size >= piece.size || !piece.data.length) break;
      }
      save(`${name}.mcap`, new Blob(pieces));
    } catch (error) {
      this.onrefusal(error.message);
    }
    say(button, name);
    button.disabled = false;
  }
}
