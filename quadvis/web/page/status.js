// The left side: state, modes, verdicts, tasks, ages.

import { find, make, say, show } from "./dom.js";
import { time, value } from "./format.js";

const MODES = /^(?:mode|reason|state|status|stale|landed|descend|source|blind|found|lost)$/;

const BAR = 4; // px of a bar of a histogram

export class Status {
  overran = new Map(); // by task: performance.now() until which it is ringed
  #overruns = new Map();
  #rows = new Map();

  constructor(model) {
    this.model = model;
    this.tasks = find("#tasks");
    this.verdicts = find("#verdicts");
    this.problem = find("#problem");
  }

  /** Choose the signals of modes and ages; return their names. */
  async begin() {
    const signals = [...this.model.signals.values()];
    const failsafe = signals.filter((signal) => signal.block.startsWith("supervision.") && MODES.test(signal.port) && !signal.shape.length);
    const sight = signals.filter((signal) => /detector$/.test(signal.block) && /^status$/.test(signal.port));
    this.modes = [...failsafe.filter((each) => each.block === "supervision.failsafe"), ...failsafe.filter((each) => each.block !== "supervision.failsafe"), ...sight];
    this.modes = this.modes.filter((each) => each.type !== "float64");
    this.ages = signals.filter((signal) => /^(?:age|lost|refused)$/.test(signal.port) && !signal.shape.length && signal.type !== "bool");
    this.#rows.clear();
    this.#overruns.clear();
    this.#list(find("#modes"), this.modes);
    this.#list(find("#links"), this.ages);
    return [...this.modes, ...this.ages].map((signal) => signal.name);
  }

  #list(section, signals) {
    show(section, signals.length > 0);
    find("dl", section).replaceChildren(...signals.flatMap((signal) => {
      const row = make("dd", { title: signal.doc });
      this.#rows.set(signal.name, row);
      return [make("dt", { textContent: signal.name, title: signal.doc }), row];
    }));
  }

  values() {
    for (const [name, row] of this.#rows) {
      const signal = this.model.signals.get(name);
      say(row, value(signal, this.model.values.get(name)) || "\u2013");
    }
  }

  take(status) {
    show(this.problem, Boolean(status.Problem));
    say(find("p", this.problem), status.Problem ?? "");
    this.#tasks(status.Tasks ?? []);
    const verdicts = (status.Verdicts ?? []).map((each) => [each.met, `${each.met ? "met" : "NOT MET"}: ${each.expectation}: ${each.shown}`]);
    show(this.verdicts, verdicts.length > 0);
    const text = verdicts.join("\n");
    if (text !== this.verdictsShown) {
      this.verdictsShown = text;
      find("ul", this.verdicts).replaceChildren(...verdicts.map(([met, each]) => make("li", { className: met ? "met" : "missed", textContent: each })));
    }
  }

  #tasks(tasks) {
    show(this.tasks, tasks.some((each) => each.steps));
    const rows = find(".rows", this.tasks);
    while (rows.children.length > tasks.length) rows.lastChild.remove();
    tasks.forEach((task, index) => {
      const key = `${task.computer} ${task.task}`;
      const last = this.#overruns.get(key) ?? task.overruns;
      if (task.overruns > last) this.overran.set(task.task, performance.now() + 3000);
      this.#overruns.set(key, task.overruns);
      const row = rows.children[index] ?? rows.appendChild(taskRow());
      const [name, overruns] = row.querySelectorAll("b, i");
      say(name, [task.computer, task.task].filter(Boolean).join(" "));
      say(overruns, task.overruns ? `${task.overruns} overrun${task.overruns > 1 ? "s" : ""}` : "");
      const [tet, late] = row.querySelectorAll(".spread");
      spread(tet, task.execution, task.period_s);
      spread(late, task.lateness, task.period_s);
    });
  }

  /** The tasks that overran a short while ago. */
  get ringed() {
    const now = performance.now();
    return new Set([...this.overran].filter(([, until]) => until > now).map(([name]) => name));
  }
}

function taskRow() {
  const line = (label, title) => make("div", { className: "spread", title }, make("span", { textContent: label }), make("canvas", { width: 130, height: 22 }), make("small"));
  return make("div", { className: "task" }, make("b"), make("i"), line("TET", "execution time of a step"), line("late", "lateness of the begin of a step"));
}

/** Draw a spread over powers of ten up to the period: bars if there is a histogram, mean and largest as marks. */
function spread(row, facts, period) {
  const [, canvas, text] = row.children;
  if (!facts) return say(text, "");
  say(text, `${time(facts.mean_s)}, max ${time(facts.max_s)}`);
  const context = canvas.getContext("2d");
  const { width, height } = canvas;
  const [from, to] = [1e-6, Math.max(period, facts.max_s) * 1.3];
  const x = (seconds) => (Math.log(Math.max(seconds, from) / from) / Math.log(to / from)) * (width - 2) + 1;
  const style = getComputedStyle(canvas);
  context.clearRect(0, 0, width, height);
  context.fillStyle = style.color;
  const bars = new Float64Array(Math.ceil(width / BAR));
  for (const { from_s: begin, to_s: end, count } of facts.histogram ?? []) bars[Math.floor(x((begin + end) / 2) / BAR)] += count;
  const most = Math.max(...bars, 1);
  context.globalAlpha = 0.55;
  bars.forEach((count, index) => {
    const tall = count && Math.max(1.5, (Math.log1p(count) / Math.log1p(most)) * (height - 3));
    context.fillRect(index * BAR, height - tall, BAR - 0.5, tall);
  });
  context.globalAlpha = 1;
  if (!facts.histogram) context.fillRect(x(facts.min_s), height / 2 - 1, Math.max(1, x(facts.max_s) - x(facts.min_s)), 2);
  context.fillRect(x(facts.mean_s) - 1, 2, 2, height - 2);
  context.fillStyle = facts.max_s > period ? style.outlineColor : style.borderTopColor;
  context.fillRect(x(period), 0, 1.5, height);
}
