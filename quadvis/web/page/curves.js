// Curves over time, drawn by uPlot: one scale for each unit.

import uPlot from "./uplot/uPlot.esm.js";
import { colour, colours } from "./colours.js";
import { number, unit } from "./format.js";

const FRAME = 30; // ms between two drawings
const SHARE = 5; // at most one part in so many of the time goes into drawing

export class Curves {
  #plot = null;
  #due = false;
  #last = 0;
  #cost = 0; // ms of a drawing, of late

  /** `onzoom` is called when a person chooses a stretch, `oncursor` with the values under the pointer or null. */
  constructor(box, { onzoom, oncursor }) {
    Object.assign(this, { box, onzoom, oncursor });
    this.resized = new ResizeObserver(() => this.#fit());
    this.resized.observe(box);
  }

  /** Draw these curves from now on: a list of {name, unit}. */
  begin(curves) {
    this.end();
    const scales = [...new Set(curves.map((curve) => curve.unit))];
    const lines = { stroke: colour("line"), width: 1 };
    const text = { stroke: colour("text"), font: "11px system-ui, sans-serif", grid: lines, ticks: lines };
    const axis = (scale, index) => ({
      ...text, scale, side: index ? 1 : 3, size: 58, grid: index ? { show: false } : lines, label: unit(scale), labelSize: 16,
      labelFont: text.font, values: (_, splits) => splits.map((each) => number(+each.toPrecision(6))),
    });
    this.#plot = new uPlot(
      {
        width: this.box.clientWidth || 300, height: this.box.clientHeight || 200, pxAlign: false,
        legend: { show: false }, cursor: { drag: { x: true, y: false, setScale: false }, points: { size: 5 } },
        scales: { x: { time: false }, ...Object.fromEntries(scales.map((each) => [each, { auto: true }])) },
        axes: [{ ...text, size: 30, values: (_, splits) => splits.map((each) => `${+each.toFixed(3)} s`) }, ...scales.slice(0, 2).map(axis)],
        series: [{}, ...curves.map((curve, index) => ({
          scale: curve.unit, label: curve.name, stroke: colours()[index % colours().length], width: 1.4,
          dash: index >= colours().length ? [6, 4] : undefined, points: { show: false }, spanGaps: false,
        }))],
        hooks: {
          setSelect: [(plot) => this.#select(plot)],
          setCursor: [(plot) => this.oncursor(plot.cursor.idx === null || plot.cursor.left < 0 ? null : plot.data.map((each) => each[plot.cursor.idx]))],
        },
      },
      [[], ...curves.map(() => [])],
      this.box,
    );
  }

  end() {
    this.#plot?.destroy();
    this.#plot = null;
  }

  /** Draw soon; `data` returns lists of times and values, and the range of times. */
  draw(data) {
    this.data = data;
    if (this.#due || !this.#plot) return;
    this.#due = true;
    const wait = Math.max(0, this.#last + Math.max(FRAME, SHARE * this.#cost) - performance.now());
    setTimeout(() => requestAnimationFrame(() => this.#now()), wait);
  }

  #now() {
    this.#due = false;
    if (!this.#plot) return;
    this.#last = performance.now();
    const { lists, from, to } = this.data();
    this.#plot.batch(() => {
      this.#plot.setData(lists, false);
      this.#plot.setScale("x", { min: from, max: to });
    });
    // What the canvas takes shows when the next task has its turn.
    setTimeout(() => (this.#cost += (performance.now() - this.#last - this.#cost) / 4));
  }

  #select(plot) {
    if (plot.select.width < 4) return;
    const [from, to] = [plot.posToVal(plot.select.left, "x"), plot.posToVal(plot.select.left + plot.select.width, "x")];
    plot.setSelect({ left: 0, width: 0, top: 0, height: 0 }, false);
    this.onzoom(from, to);
  }

  #fit() {
    const { clientWidth: width, clientHeight: height } = this.box;
    if (this.#plot && width && height) this.#plot.setSize({ width, height });
  }

  /** Return the picture as it is, on the colour of the page. */
  picture() {
    const source = this.#plot.ctx.canvas;
    const canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = [source.width, source.height];
    const context = canvas.getContext("2d");
    context.fillStyle = colour("paper");
    context.fillRect(0, 0, canvas.width, canvas.height);
    context.drawImage(source, 0, 0);
    const size = 12 * devicePixelRatio;
    context.font = `${size}px system-ui, sans-serif`;
    let x = 70 * devicePixelRatio;
    for (const series of this.#plot.series.slice(1)) {
      context.fillStyle = series.stroke(this.#plot);
      context.fillText(series.label, x, size * 1.2);
      x += context.measureText(series.label).width + size;
    }
    return new Promise((done) => canvas.toBlob(done, "image/png"));
  }
}
