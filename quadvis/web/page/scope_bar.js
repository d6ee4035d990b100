// The bar of the scope: its signals with their colours, its settings and buttons.

import { colours } from "./colours.js";
import { make, say, show } from "./dom.js";
import { number, unit } from "./format.js";

export const WINDOW = 10; // s
const WINDOWS = [1, 2, 5, 10, 30, 60];
const MODES = { FreeRun: "free", Signal: "on a signal", Software: "by hand" };
const SLOPES = { Rising: "rises above", Falling: "falls below", Either: "crosses" };

const choice = (options, chosen, label, onchange) =>
  make("select", { onchange, "aria-label": label }, ...Object.entries(options).map(([value, text]) => make("option", { value, textContent: text, selected: value === String(chosen) })));

const button = (textContent, title, onclick) => make("button", { type: "button", textContent, title, onclick });

/** Return the bar of a scope as {element, take(curves), update(), cursor(row, curves)}. */
export function bar(scope) {
  const { settings } = scope;
  const signals = make("div", { className: "signals" });
  const mode = choice(MODES, settings.mode, "trigger", () => scope.adjust({ mode: mode.value }));
  const trigger = make("select", { "aria-label": "signal of the trigger", onchange: () => scope.adjust({ signal: trigger.value }) });
  const slope = choice(SLOPES, settings.slope, "slope of the trigger", () => scope.adjust({ slope: slope.value }));
  const level = make("input", { type: "number", step: "any", value: settings.level, "aria-label": "level of the trigger", onchange: () => scope.adjust({ level: Number(level.value) || 0 }) });
  const now = button("Trigger", "acquire now", () => scope.trigger());
  const windows = Object.fromEntries(WINDOWS.map((each) => [each, `${each} s`]));
  const window = choice(windows, settings.window, "stretch of time", () => scope.adjust({ window: Number(window.value) }));
  const pause = button("Pause", "space", () => scope.pause());
  const controls = make("div", { className: "controls" },
    mode, trigger, slope, level, now, window, pause,
    button("CSV", "save the samples in view", () => scope.saveTable()),
    button("PNG", "save the picture", () => scope.savePicture()),
    button("\u00d7", "close (Esc)", () => scope.close()));
  const element = make("div", { className: "bar" }, signals, controls);

  function update() {
    const byHand = scope.samples;
    for (const each of [mode]) show(each, byHand);
    for (const each of [trigger, slope, level]) show(each, byHand && settings.mode === "Signal");
    show(now, byHand && settings.mode !== "FreeRun");
    say(pause, scope.paused ? "Go on" : "Pause");
    element.classList.toggle("paused", scope.paused);
  }

  function take(curves) {
    signals.replaceChildren(...curves.map((curve, index) => {
      const colour = colours()[index % colours().length];
      const chip = make("button", { type: "button", className: "signal", title: `${curve.signal.doc}\nclick: leave ${curve.signal.name} out`, onclick: () => scope.toggle(curve.signal.name) },
        make("i"), make("span", { textContent: curve.name }), make("output"));
      chip.firstChild.style.background = colour;
      return chip;
    }));
    trigger.replaceChildren(...curves.map((curve) => make("option", { value: curve.name, textContent: curve.name, selected: curve.name === settings.signal })));
    update();
  }

  function cursor(row, curves) {
    curves.forEach((curve, index) => {
      const output = signals.children[index]?.lastChild;
      const found = row?.[index + 1];
      if (output) say(output, found === null || found === undefined ? "" : `${number(found)} ${unit(curve.unit)}`);
    });
  }

  return { element, take, update, cursor };
}
