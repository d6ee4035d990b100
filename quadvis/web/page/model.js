// What the target is and what its signals were a short while ago.

const PAST = 200; // values of each signal that are kept, some 20 s
const APART = 95; // ms between two of them

/** The newest numbers of a signal, in a ring. */
class Past {
  constructor(width) {
    this.width = Math.min(width, 4);
    this.numbers = new Float64Array(PAST * this.width);
    this.count = 0;
  }

  add(value) {
    const numbers = Array.isArray(value) ? value.flat(Infinity) : [value];
    const at = (this.count++ % PAST) * this.width;
    for (let index = 0; index < this.width; index++) this.numbers[at + index] = Number(numbers[index]);
  }

  /** Yield the numbers of one element, the oldest first. */
  *of(element) {
    for (let index = Math.max(0, this.count - PAST); index < this.count; index++) {
      yield this.numbers[(index % PAST) * this.width + element];
    }
  }
}

/** Return numbers in the shape of a signal; what is no number becomes a text, such as "NaN". */
function shaped(numbers, shape) {
  if (!shape.length) return Number.isFinite(numbers[0]) ? numbers[0] : String(numbers[0]);
  const [count, ...inner] = shape;
  const size = numbers.length / count;
  return Array.from({ length: count }, (_, at) => shaped(numbers.subarray(at * size, (at + 1) * size), inner));
}

export class Model {
  signals = new Map(); // by name
  parameters = new Map(); // lists by block
  values = new Map(); // by name; null before the first one
  past = new Map();
  kinds = new Map(); // the name of the block type, by block
  tasks = new Map(); // the task, by block
  status = {};
  watched = { set: null, names: [], sizes: [] };
  #kept = -Infinity; // when the past was added to
  #docs = new Map();

  constructor(connection) {
    this.connection = connection;
  }

  /** Ask for all that does not change while an application is loaded. */
  async load() {
    for (const map of [this.signals, this.values, this.past, this.kinds, this.tasks, this.parameters]) map.clear();
    const parameters = this.connection.may("parameters") ? this.loadParameters() : null;
    for (const signal of await this.#all("signals")) {
      const { 0: block } = signal.name.match(/^.*(?=\.)/);
      Object.assign(signal, { path: block, port: signal.name.slice(block.length + 1), words: null });
      this.signals.set(signal.name, signal);
      this.kinds.set(block, signal.block);
      this.tasks.set(block, signal.task);
    }
    await parameters;
  }

  async loadParameters() {
    this.parameters.clear();
    for (const each of await this.#all("parameters")) {
      const path = each.name.slice(0, each.name.lastIndexOf("."));
      this.kinds.set(path, each.block);
      this.parameters.set(path, [...(this.parameters.get(path) ?? []), each]);
    }
  }

  async #all(verb) {
    const found = await this.connection.request(verb);
    while (found.length && found.length % 4000 === 0) {
      const more = await this.connection.request(verb, { first: found.length });
      if (!more.length) break;
      found.push(...more);
    }
    return found;
  }

  /** Return what a block is; the same promise each time. */
  describe(kind) {
    if (!this.#docs.has(kind)) this.#docs.set(kind, this.connection.request("describe", { block: kind }));
    this.#docs.get(kind).catch(() => this.#docs.delete(kind));
    return this.#docs.get(kind);
  }

  /** Take the numbers of all that is watched; return false if they are of another set. */
  take({ set, without }, numbers) {
    if (set !== this.watched.set) return false;
    const now = performance.now();
    const kept = this.status.Status === "running" && now - this.#kept >= APART;
    if (kept) this.#kept = now;
    const lacks = new Set(without);
    let at = 0;
    this.watched.names.forEach((name, place) => {
      const size = this.watched.sizes[place];
      const shape = this.signals.get(name)?.shape ?? [];
      const found = lacks.has(place) ? null : shaped(numbers.subarray(at, at + size), shape);
      at += size;
      this.values.set(name, found);
      if (found === null || !kept) return;
      if (!this.past.has(name)) this.past.set(name, new Past(size));
      this.past.get(name).add(found);
    });
    return true;
  }

  /** Return the signal that a wire takes: "craft.position[0]" takes from "craft.position". */
  signalOf(source) {
    return this.signals.get(source.replace(/\[.*$/, ""));
  }
}
