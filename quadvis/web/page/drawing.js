// The diagram: wires with their values, blocks to click on, rings around what overran.

import { make, show } from "./dom.js";
import { value } from "./format.js";
import { Labels } from "./labels.js";
import { draw } from "./spark.js";
import { makeSvg, readDrawing } from "./svg.js";
import { View } from "./view.js";

const FAR = 0.45; // pixels of the screen for one unit, below which names are all that can be read

/** Say how far below its place the name of a block is in its middle, if nothing but text is there. */
function centre(block) {
  const [outline, name] = [".outline", ".name"].map((each) => block.querySelector(`:scope > ${each}`));
  const bare = [...block.children].every((each) => each.matches("title, .outline, .name, .kind, .port, .mark"));
  if (!outline || !name || !bare) return;
  const { y, height } = outline.getBBox();
  const at = Number(name.getAttribute("y"));
  if (at > y && at < y + height) name.style.setProperty("--down", `${y + height / 2 - at}px`);
}

export class Drawing {
  #blocks = new Map();
  #wires = [];
  #hovered = null;
  onwire = () => {};
  onblock = () => {};

  constructor(frame, hint, colours, model) {
    Object.assign(this, { frame, hint, colours, model });
    this.view = new View(frame, () => this.#scaled());
    frame.addEventListener("click", (event) => this.#click(event));
    frame.addEventListener("pointermove", (event) => this.#hover(event));
    frame.addEventListener("pointerleave", () => this.#hover(null));
  }

  /** Show a drawing. */
  take(text) {
    const svg = readDrawing(text);
    const content = svg.querySelector(":scope > g:has(g.block)") ?? svg;
    this.#legend(svg.querySelector(":scope > g"));
    svg.replaceChildren(content); // paper, title and legend are those of the page
    for (const name of ["width", "height"]) svg.removeAttribute(name);
    this.#wires = [...svg.querySelectorAll("g.wire")];
    const blocks = [...svg.querySelectorAll("g.block")];
    this.#blocks = new Map(blocks.map((block) => [block.dataset.path, block]));
    for (const wire of this.#wires) {
      const reach = wire.querySelector("polyline").cloneNode();
      reach.setAttribute("class", "reach");
      wire.prepend(reach);
    }
    const layer = makeSvg("g", { class: "values" });
    content.append(layer);
    const solid = svg.querySelectorAll(".block > .outline, .part > text");
    this.labels = new Labels(layer, this.#wires, [...solid], this.model);
    this.frame.replaceChildren(svg);
    content.removeAttribute("transform");
    this.svg = svg;
    blocks.forEach(centre);
    this.view.take(svg, content.getBBox());
    this.#scaled();
  }

  /** Show a sentence in the place of a drawing. */
  clear(sentence) {
    this.#wires = [];
    this.#blocks.clear();
    this.labels = this.svg = this.view.svg = null;
    this.colours.replaceChildren();
    this.frame.replaceChildren(make("p", { className: "empty", textContent: sentence }));
  }

  /** Show the colours of the tasks. */
  #legend(legend) {
    const texts = legend ? [...legend.querySelectorAll("text")] : [];
    this.colours.replaceChildren(...texts.map((text) => {
      const mark = text.previousElementSibling;
      const sample = make("i", { className: Number(mark.getAttribute("rx")) > 3 ? "pill" : "" });
      sample.style.background = mark.getAttribute("fill");
      sample.style.borderColor = mark.getAttribute("stroke");
      return make("span", {}, sample, text.textContent);
    }));
  }

  /** The signals that wires show. */
  get sources() {
    const found = this.#wires.map((wire) => this.model.signalOf(wire.dataset.source));
    return [...new Set(found.filter((signal) => signal && signal.type !== "frame").map((signal) => signal.name))];
  }

  /** The signals on wires that have no numbers: rows hold none, so they are pictures. */
  get pictures() {
    const sources = this.#wires.map((wire) => wire.dataset.source);
    return [...new Set(sources.filter((source) => (this.model.signalOf(source)?.type ?? "frame") === "frame"))];
  }

  update() {
    this.labels?.update();
    if (this.#hovered) this.#fill();
  }

  /** Ring the blocks of some tasks. */
  ring(tasks) {
    for (const [path, block] of this.#blocks) {
      block.classList.toggle("overran", tasks.has(this.model.tasks.get(path)));
    }
  }

  /** Mark the wires that a scope shows, and the block that is looked at. */
  mark(sources, path) {
    for (const wire of this.#wires) wire.classList.toggle("marked", sources.has(wire.dataset.source.replace(/\[.*$/, "")));
    for (const [each, block] of this.#blocks) block.classList.toggle("marked", each === path);
  }

  #scaled() {
    if (!this.svg) return;
    this.svg.classList.toggle("far", this.view.scale < FAR);
    this.svg.style.setProperty("--name", `${Math.min(25, Math.max(13, 10.5 / this.view.scale))}px`);
    this.labels?.scale(this.view.scale);
  }

  #click(event) {
    if (this.view.dragged) return;
    const found = event.target.closest?.("g.block, g.wire");
    if (found?.classList.contains("block")) this.onblock(found.dataset.path);
    else if (found) this.onwire(found.dataset.source);
  }

  #hover(event) {
    const wire = event?.pointerType === "touch" ? null : event?.target.closest?.("g.wire");
    const signal = wire && this.model.signalOf(wire.dataset.source);
    this.#hovered = signal || null;
    show(this.hint, Boolean(signal));
    if (!signal) return;
    if (this.hint.dataset.signal !== signal.name) {
      this.hint.dataset.signal = signal.name;
      this.hint.replaceChildren(make("b", {}, signal.name), make("span"), make("canvas", { width: 220, height: 48 }), make("small", {}, signal.doc));
    }
    const { left, top, width, height } = this.frame.getBoundingClientRect();
    const [x, y] = [event.clientX - left, event.clientY - top];
    this.hint.style.left = `${Math.min(x + 14, width - 240)}px`;
    this.hint.style.top = y > height - 150 ? `${y - 140}px` : `${y + 14}px`;
    this.#fill();
  }

  #fill() {
    const [, text, canvas] = this.hint.children;
    text.textContent = value(this.#hovered, this.model.values.get(this.#hovered.name), 9);
    draw(canvas, this.model.past.get(this.#hovered.name));
  }
}
