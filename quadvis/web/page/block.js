// One block: what it is, the values of its outputs, its parameters, which can be changed.

import { calls } from "./calls.js";
import { find, make, say, show } from "./dom.js";
import { number, unit, value } from "./format.js";

/** Return a value of a parameter as a person types it: "2 rad/s", "[1, 2, 3] m". */
function typed(found) {
  if (found && typeof found === "object" && !Array.isArray(found)) return `${typed(found.value)} ${found.unit ?? ""}`.trim();
  return Array.isArray(found) ? `[${found.map(typed).join(", ")}]` : String(found);
}

/** Return what was typed as the target reads it: a list with a unit as a map. */
function read(text) {
  const [, list, name] = text.trim().match(/^(\[.*\])\s*(\S.*)$/) ?? [];
  return list ? `{value: ${list}, unit: ${name}}` : text.trim();
}

function bounds({ min, max, unit: name }) {
  const suffix = unit(name) && ` ${unit(name)}`;
  if (min !== null && max !== null) return `${number(min)} to ${number(max)}${suffix}`;
  if (min !== null) return `from ${number(min)}${suffix}`;
  return max !== null ? `up to ${number(max)}${suffix}` : unit(name);
}

export class Block {
  path = "";
  onclose = () => {};
  onsignal = () => {};

  constructor(box, connection, model) {
    Object.assign(this, { box, connection, model });
  }

  async open(path) {
    this.path = path;
    const kind = this.model.kinds.get(path) ?? "";
    const doc = make("p", { className: "doc" });
    this.outputs = [...this.model.signals.values()].filter((signal) => signal.path === path);
    const parameters = this.model.parameters.get(path) ?? [];
    this.box.replaceChildren(
      make("h2", {}, path, make("button", { type: "button", className: "close", textContent: "\u00d7", title: "close (Esc)", onclick: () => this.close() })),
      make("p", { className: "kind", textContent: kind }),
      doc,
      make("h3", { hidden: !parameters.length, textContent: "Parameters" }),
      ...parameters.map((each) => this.#row(each)),
      make("h3", { hidden: !this.outputs.length, textContent: "Outputs" }),
      make("dl", { className: "outputs" }, ...this.outputs.flatMap((signal) => [
        make("dt", {}, make("button", { type: "button", className: "plain", textContent: signal.port, title: `${signal.doc}\nclick: show it in the scope`, disabled: signal.type === "frame", onclick: () => this.onsignal(signal.name) })),
        make("dd", { title: signal.doc }),
      ])),
      ...(this.connection.may("startprofiler") ? calls(this.connection, path) : []),
    );
    show(this.box, true);
    this.update();
    try {
      const found = await this.model.describe(kind);
      if (this.path === path) this.#describe(doc, found.doc);
    } catch (error) {
      say(doc, error.message);
    }
  }

  close() {
    this.path = "";
    show(this.box, false);
    this.onclose();
  }

  update() {
    if (!this.path) return;
    const values = this.box.querySelectorAll(".outputs dd");
    this.outputs.forEach((signal, index) => say(values[index], value(signal, this.model.values.get(signal.name)) || "\u2013"));
  }

  /** Show the first sentence of a documentation, and all of it when asked. */
  #describe(element, text) {
    const [first, ...rest] = text.split("\n\n");
    element.replaceChildren(first.replaceAll("\n", " "));
    if (rest.length) element.after(make("details", {}, make("summary", { textContent: "more" }), make("pre", { textContent: rest.join("\n\n") })));
  }

  #row(parameter) {
    const name = parameter.name.slice(this.path.length + 1);
    const label = make("label", { title: parameter.doc }, name);
    const note = make("p", { className: "note", textContent: bounds(parameter) });
    const row = make("form", { className: "parameter", autocomplete: "off" }, label);
    if (!parameter.tunable || !this.connection.may("setparam")) {
      row.append(make("span", { className: "fixed", textContent: unit(typed(parameter.value)), title: parameter.tunable ? "" : "cannot be changed in a run" }));
      if (parameter.tunable) row.append(note);
      return row;
    }
    const input = parameter.choices.length
      ? make("select", {}, ...parameter.choices.map((each) => make("option", { textContent: each, selected: each === parameter.value })))
      : make("input", { value: typed(parameter.value), spellcheck: false, "aria-label": parameter.name });
    input.addEventListener("change", () => row.classList.add("changed"));
    row.append(input, make("button", { textContent: "Set" }), note);
    row.onsubmit = (event) => {
      event.preventDefault();
      this.#tune(parameter, read(input.value), row, note, input);
    };
    return row;
  }

  async #tune(parameter, given, row, note, input) {
    try {
      const { tick, time, changes } = await this.connection.request("setparam", { values: { [parameter.name]: given } });
      const taken = changes.find((change) => change.name === parameter.name);
      if (taken) {
        parameter.value = taken.new;
        if (!parameter.choices.length) input.value = typed(taken.new);
      }
      say(note, `holds from tick ${tick}, ${number(time)} s`);
      row.className = "parameter held";
    } catch (error) {
      say(note, error.message);
      row.className = "parameter refused";
    }
  }
}
