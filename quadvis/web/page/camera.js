// The right side: what the camera saw, with what was found in it and what was dropped.

import { colour } from "./colours.js";
import { find, say, show } from "./dom.js";

const EVERY = 200; // ms between two pictures
const AGAIN = 1500; // ms after a refusal
const DETECTOR = "vision.circle_detector";
const QUALITY = 0.9; // of a circle that counts as a whole one
const RADIUS = 0.16; // of a mark, as a part of the distance between neighbours

export class Camera {
  #names = []; // of signals that may be pictures; the first one is shown
  #shown = -1;

  constructor(connection, model) {
    Object.assign(this, { connection, model });
    this.section = find("#camera");
    this.canvas = find("canvas", this.section);
    this.text = find(".found", this.section);
    this.#loop();
  }

  /** Look at the first of some signals that is a picture; return the signals that say what was found in it. */
  begin(names) {
    this.#names = this.connection.may("picture") ? names : [];
    this.#shown = -1;
    show(this.section, false);
    const detector = [...this.model.signals.values()].find((signal) => signal.block === DETECTOR)?.path;
    this.detected = detector ? { centres: `${detector}.centres`, quality: `${detector}.quality` } : null;
    return this.detected && this.#names.length ? Object.values(this.detected) : [];
  }

  async #loop() {
    for (;;) {
      let wait = EVERY;
      if (this.#names.length && this.connection.hello && document.visibilityState === "visible") {
        try {
          await this.#show(await this.connection.request("picture", { signal: this.#names[0] }));
        } catch (error) {
          say(this.text, error.message);
          wait = AGAIN;
          if (/is no signal/.test(error.message)) this.#names.shift();
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
    show(this.section, true);
    const found = picture.found ?? this.#found();
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
    if (picture.sequence !== undefined) words.push(`picture ${picture.sequence}`);
    if (picture.stamp !== undefined) words.push(`taken at ${picture.stamp.toFixed(1)} s`);
    say(this.text, words.join("; "));
  }

  /** Return what the detector of circles says: circles with a quality below the least are dropped. */
  #found() {
    if (!this.detected) return [];
    const [centres, quality] = Object.values(this.detected).map((name) => this.model.values.get(name) ?? []);
    const seen = centres.map((pair) => pair.map(Number)).filter(([u]) => Number.isFinite(u));
    const apart = seen.flatMap(([u, v], index) => seen.slice(index + 1).map(([x, y]) => Math.hypot(u - x, v - y)));
    const radius = RADIUS * Math.min(...apart, this.canvas.width / 3);
    return centres.map(([u, v], index) => {
      const kept = Number(quality[index]) >= QUALITY;
      return { u: Number(u), v: Number(v), radius, label: `${index + 1}`, kept, reason: kept ? "" : "partly hidden" };
    }).filter(({ u }) => Number.isFinite(u));
  }
}
