// The scope below the diagram: several signals, free or triggered, paused, zoomed, saved.

import { onScheme } from "./colours.js";
import { Curves } from "./curves.js";
import { make, save, show } from "./dom.js";
import { unit } from "./format.js";
import { MOST, Samples } from "./samples.js";
import { bar, WINDOW } from "./scope_bar.js";

const PACKAGE = 0.05; // s of samples in one package while it runs free
const MOST_CURVES = 24;
const ELEMENTS = 8; // of one signal
const BEFORE = 0.2; // of an acquisition lies before its trigger

export class Scope {
  signals = []; // names
  #curves = []; // {name, unit, signal}
  #id = null;
  #topic = "";
  #changes = Promise.resolve();
  #zoom = null;
  paused = false;
  onchange = () => {};
  onrefusal = () => {};

  constructor(box, connection, model) {
    Object.assign(this, { box, connection, model });
    this.settings = { window: WINDOW, mode: "FreeRun", signal: "", level: 0, slope: "Rising" };
    this.bar = bar(this);
    this.plot = make("div", { className: "plot" });
    box.append(this.bar.element, this.plot);
    this.curves = new Curves(this.plot, {
      onzoom: (from, to) => this.#setZoom({ from, to }),
      oncursor: (row) => this.bar.cursor(row, this.#curves),
    });
    this.plot.addEventListener("dblclick", () => this.#setZoom(null));
    onScheme(() => this.#plotAgain());
    connection.on("scope", ({ data, samples, topic }) => topic === this.#topic && this.#take(data, samples));
  }

  get isOpen() {
    return this.signals.length > 0;
  }

  /** Whether the target samples for this page; else it shows the values that it gets anyway. */
  get samples() {
    return this.connection.may("addscope");
  }

  /** Show a signal, too, or no longer. */
  toggle(name) {
    const has = this.signals.includes(name);
    this.#set(has ? this.signals.filter((each) => each !== name) : [...this.signals, name]);
  }

  close() {
    this.#set([]);
  }

  /** Begin again with the same signals, as far as they exist: another run, or another connection. */
  renew(fresh = false) {
    if (fresh) this.#id = null;
    this.#set(this.signals.filter((name) => this.model.signals.has(name)));
  }

  /** Change settings. */
  adjust(settings) {
    Object.assign(this.settings, settings);
    this.#set(this.signals);
  }

  pause(paused = !this.paused) {
    this.paused = paused;
    if (!paused) this.#zoom = null;
    this.bar.update();
    this.#draw();
  }

  trigger() {
    if (this.#id !== null) this.connection.request("trigger", { ids: [this.#id] }).catch((error) => this.onrefusal(error.message));
  }

  #set(signals) {
    const chosen = [];
    for (const name of signals) {
      const signal = this.model.signals.get(name);
      if (!signal) continue;
      const names = elements(name, signal.shape).slice(0, ELEMENTS);
      chosen.push(...names.map((each) => ({ name: each, unit: signal.unit, signal })));
    }
    this.#curves = chosen.slice(0, MOST_CURVES);
    this.signals = signals;
    show(this.box, this.isOpen);
    this.onchange();
    this.#begin();
    this.#changes = this.#changes.then(() => this.#tell()).catch((error) => this.onrefusal(error.message));
  }

  #begin() {
    this.data = new Samples(this.#curves.length);
    this.#zoom = null;
    this.paused = false;
    this.at = NaN;
    this.#plotAgain();
  }

  /** Make the plot anew, with the samples that are there. */
  #plotAgain() {
    this.bar.take(this.#curves);
    this.#still = false;
    if (this.isOpen) this.curves.begin(this.#curves);
    else this.curves.end();
    this.#draw();
  }

  /** Have the target sample what is shown. */
  async #tell() {
    if (!this.connection.hello || !this.samples) return;
    if (!this.isOpen) {
      if (this.#id !== null) await this.connection.request("remscope", { ids: [this.#id] });
      this.#id = null;
      return;
    }
    if (this.#id === null) {
      this.#id = await this.connection.request("addscope");
      this.#topic = `scope/${this.#id}`;
      await this.connection.request("listen", { topics: [this.#topic] });
    } else await this.connection.request("stopscope", { ids: [this.#id] });
    await this.connection.request("setscope", { id: this.#id, values: this.#properties() });
    await this.connection.request("startscope", { ids: [this.#id] });
  }

  #properties() {
    const { window, mode, signal, level, slope } = this.settings;
    const period = this.model.status.SampleTime || 0.01;
    const decimation = Math.max(1, Math.ceil(window / period / MOST));
    const free = mode === "FreeRun";
    const count = Math.max(1, Math.round((free ? PACKAGE : window) / period / decimation));
    const found = {
      Signals: this.#curves.map((curve) => curve.name), Decimation: decimation, NumSamples: Math.min(count, MOST),
      NumPrePostSamples: free ? 0 : -Math.round(BEFORE * count), TriggerMode: mode, AutoRestart: !free,
    };
    if (mode === "Signal") {
      const known = this.#curves.some((curve) => curve.name === signal);
      this.settings.signal = known ? signal : this.#curves[0].name;
      Object.assign(found, { TriggerSignal: this.settings.signal, TriggerLevel: level, TriggerSlope: slope });
    }
    return found;
  }

  #take(header, samples) {
    if (header.names?.join() !== this.#curves.map((curve) => curve.name).join()) return; // of the last settings
    if (this.settings.mode !== "FreeRun") {
      if (this.paused) return;
      if (!header.part) this.data.clear();
    }
    this.data.add(samples);
    if (header.trigger !== null && header.trigger !== undefined) this.at = this.data.columns[0][header.trigger];
    this.#draw();
  }

  /** Draw the newest values, if the target does not sample for this page. */
  takeValues() {
    if (this.samples || !this.isOpen) return;
    const row = [this.model.status.ExecTime];
    if (!(row[0] > this.data.end || Number.isNaN(this.data.end))) return;
    for (const { name, signal } of this.#curves) {
      const index = [...name.slice(signal.name.length).matchAll(/\d+/g)].map(Number);
      row.push(Number(index.reduce((inner, at) => inner?.[at], this.model.values.get(signal.name) ?? NaN)));
    }
    this.data.add(row);
    this.#draw();
  }

  #range() {
    if (this.#zoom) return this.#zoom;
    if (this.settings.mode !== "FreeRun" && this.data.count) return { from: this.data.columns[0][0], to: this.data.end };
    const to = Number.isFinite(this.data.end) ? this.data.end : this.settings.window;
    return { from: to - this.settings.window, to };
  }

  #draw() {
    if (!this.isOpen || (this.paused && !this.#zoom && this.data.count && this.#still)) return;
    this.#still = this.paused;
    this.curves.draw(() => {
      const { from, to } = this.#range();
      return { lists: this.data.between(from, to), from, to };
    });
  }
  #still = false;

  #setZoom(range) {
    this.#zoom = range;
    this.paused = range !== null;
    this.bar.update();
    this.#still = false;
    this.#draw();
  }

  saveTable() {
    const { from, to } = this.#range();
    const lists = this.data.between(from, to);
    const head = ["time [s]", ...this.#curves.map((curve) => `${curve.name}${unit(curve.unit) && ` [${curve.unit}]`}`)];
    const rows = lists[0].map((_, row) => lists.map((list) => list[row] ?? "").join(","));
    save("scope.csv", new Blob([[head.join(","), ...rows, ""].join("\n")], { type: "text/csv" }));
  }

  async savePicture() {
    save("scope.png", await this.curves.picture());
  }
}

/** Return the names of the elements of a signal: "a.b[0]", "a.b[1][2]". */
function elements(name, shape) {
  return shape.reduce((names, size) => names.flatMap((each) => Array.from({ length: size }, (_, at) => `${each}[${at}]`)), [name]);
}
