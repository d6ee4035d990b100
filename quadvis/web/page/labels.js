// The newest values, written along the wires.

import { value } from "./format.js";
import { makeSvg } from "./svg.js";

const SIZE = 9; // of the type, in units of the drawing
const LARGEST = 27; // where the drawing is small on the screen
const LEGIBLE = 9.5; // px of the screen
const SCALAR = 10, VECTOR = 22; // characters for which a label keeps its place free
const WIDTH = 0.56; // of a character, in sizes of the type
const CELL = 120; // of the grid in which places are looked up

/** Return the horizontal stretches of a line as [left, right, y], from its beginning. */
function stretches(points) {
  const corners = points.trim().split(/\s+/).map((pair) => pair.split(",").map(Number));
  const found = [];
  for (let index = 1; index < corners.length; index++) {
    const [[x0, y0], [x1, y1]] = [corners[index - 1], corners[index]];
    if (Math.abs(y1 - y0) < 0.01) found.push([Math.min(x0, x1), Math.max(x0, x1), y0]);
  }
  return found;
}

/** The value of one source, beside the longest level stretch of its wires. */
class Label {
  constructor(source, signal, place) {
    [this.left, this.right, this.y] = place;
    Object.assign(this, { source, signal, text: "" });
    this.element = makeSvg("text", { class: "value", x: this.left + 4, y: this.y - 2.5 });
  }

  /** Stand above the wire, or below it, wherever the place is free for type of a size; return the box, or null. */
  settle(size, taken) {
    const width = Math.min(this.right - this.left, (this.signal.shape.length ? VECTOR : SCALAR) * WIDTH * size);
    const above = [this.left, this.y - size, this.left + width, this.y - 1];
    const below = [this.left, this.y + 1, this.left + width, this.y + size];
    const box = width > 3 * size ? [above, below].find((each) => taken.free(each)) : null;
    this.element.setAttribute("y", box === below ? this.y + 0.9 * size : this.y - 2.5);
    this.element.style.display = box ? "" : "none";
    this.element.style.fontSize = `${size}px`;
    return box ?? null;
  }

  show(found, size) {
    const index = [...this.source.matchAll(/\[(\d+)\]/g)].map((match) => Number(match[1]));
    const chosen = index.reduce((inner, at) => inner?.[at], found);
    const room = (this.right - this.left - 8) / (WIDTH * size);
    const texts = [4, 3, 2, 1].map((most) => value(this.signal, chosen, most));
    const bare = texts.at(-1).replace(/ [^ \]]*$/, "");
    const text = [...texts, bare].find((each) => each.length <= room) ?? "";
    if (text !== this.text) this.element.textContent = this.text = text;
  }
}

const overlap = (one, other) => one[0] < other[2] && other[0] < one[2] && one[1] < other[3] && other[1] < one[3];

/** Boxes, as [left, top, right, bottom], by the cells of a grid. */
class Boxes {
  #cells = new Map();

  add(box) {
    for (const key of this.#keys(box)) this.#cells.set(key, [...(this.#cells.get(key) ?? []), box]);
  }

  free(box) {
    return this.#keys(box).every((key) => !this.#cells.get(key)?.some((other) => overlap(box, other)));
  }

  #keys([left, top, right, bottom]) {
    const found = [];
    for (let x = Math.floor(left / CELL); x <= right / CELL; x++) {
      for (let y = Math.floor(top / CELL); y <= bottom / CELL; y++) found.push(`${x} ${y}`);
    }
    return found;
  }
}

export class Labels {
  #labels = [];
  #size = 0;

  /** Put a label beside the wires of each source; `wires` are their elements, no label hides `solid` ones. */
  constructor(layer, wires, solid, model) {
    Object.assign(this, { solid, model });
    const places = new Map();
    for (const wire of wires) {
      const source = wire.dataset.source;
      const lines = stretches(wire.querySelector("polyline").getAttribute("points"));
      if (!lines.length) continue;
      const pill = wire.querySelector("title")?.textContent.endsWith(")") ? 48 : 0;
      const last = lines.length - 1;
      lines[last] = [lines[last][0], lines[last][1] - pill, lines[last][2]];
      // The stretch at the source is the best one, unless it is short.
      const best = lines.reduce((best, each, index) => {
        const length = each[1] - each[0] + (index === 0 ? 60 : 0);
        return length > best.length ? { place: each, length } : best;
      }, { length: 0 });
      if (best.place && best.length > (places.get(source)?.length ?? 0)) places.set(source, best);
    }
    const longest = [...places].sort(([, one], [, other]) => other.length - one.length);
    for (const [source, { place }] of longest) {
      const signal = model.signalOf(source);
      if (!signal || signal.type === "frame") continue;
      const label = new Label(source, signal, place);
      this.#labels.push(label);
      layer.append(label.element);
    }
  }

  /** Choose the size of the type for a scale, the pixels of the screen for one unit, and who has room for it. */
  scale(scale) {
    const size = Math.min(LARGEST, Math.max(SIZE, LEGIBLE / scale));
    if (Math.abs(size - this.#size) < 0.2) return;
    this.#size = size;
    const taken = new Boxes();
    for (const { x, y, width, height } of this.solid.map((each) => each.getBBox())) taken.add([x, y, x + width, y + height]);
    for (const label of this.#labels) {
      const box = label.settle(size, taken);
      if (box) taken.add(box);
    }
    this.update();
  }

  update() {
    for (const label of this.#labels) {
      const found = this.model.values.get(label.signal.name);
      if (found !== undefined && label.element.style.display === "") label.show(found, this.#size);
    }
  }
}
