// The right side: what the camera saw, with what was found in it and what was dropped.

import { colour } from "./colours.js";
import { find, say, show } from "./dom.js";

const EVERY = 200; // ms between two pictures
const AGAIN = 1500; // ms after a refusal

export class Camera {
  #signal = "";
  #shown = -1;

  constructor(connection, model) {
    Object.assign(this, { connection, model });
    this.section = find("#camera");
    this.canvas = find("canvas", this.section);
    this.text = find(".found", this.section);
    this.#loop();
  }

  /** Look at the first camera of the application, if it has one. */
  begin() {
    const frames = [...this.model.signals.values()].filter((signal) => signal.type === "frame");
    this.#signal = this.connection.may("picture") ? (frames[0]?.name ?? "") : "";
    this.#shown = -1;
    show(this.section, Boolean(this.#signal));
    say(this.text, "");
    this.canvas.getContext("2d").clearRect(0, 0, this.canvas.width, this.canvas.height);
  }

  async #loop() {
    for (;;) {
      let wait = EVERY;
      if (this.#signal && this.connection.hello && document.visibilityState === "visible") {
        try {
          await this.#show(await this.connection.request("picture", { signal: this.#signal }));
        } catch (error) {
          say(this.text, error.message);
          wait = AGAIN;
        }
      }
      await new Promise((done) => setTimeout(done, wait));
    }
  }

  async #show(picture) {
    if (picture.sequence === this.#shown && picture.sequence !== undefined) return;
    this.#shown = picture.sequence;
    const image = await createImageBitmap(new Blob([picture.jpeg ?? picture.data], { type: "image/jpeg" }));
    if (this.canvas.width !== image.width || this.canvas.height !== image.height) [this.canvas.width, this.canvas.height] = [image.width, image.height];
    const context = this.canvas.getContext("2d");
    context.drawImage(image, 0, 0);
    image.close();
    const found = picture.found ?? [];
    const thick = Math.max(1.5, this.canvas.width / 240);
    context.lineWidth = thick;
    context.font = `${Math.round(9.5 * thick)}px system-ui, sans-serif`;
    for (const { u, v, radius, label, kept, reason } of found) {
      context.strokeStyle = context.fillStyle = colour(kept ? "good" : "bad");
      context.setLineDash(kept ? [] : [3 * thick, 2 * thick]);
      context.beginPath();
      context.arc(u, v, radius + 2 * thick, 0, 2 * Math.PI);
      context.stroke();
      context.fillText(reason ? `${label}: ${reason}` : label, u + radius + 3 * thick, v - radius);
    }
    context.setLineDash([]);
    const dropped = found.filter((each) => !each.kept);
    const words = [`${found.length - dropped.length} found`];
    if (dropped.length) words.push(`dropped: ${dropped.map(({ label, reason }) => `${label} (${reason})`).join(", ")}`);
    if (picture.sequence !== undefined) words.push(`picture ${picture.sequence}, taken at ${picture.stamp.toFixed(1)} s`);
    say(this.text, words.join("; "));
  }
}
