// The page: what comes from the target goes to its places, what a person does goes to the target.

import { Block } from "./block.js";
import { Camera } from "./camera.js";
import { Connection } from "./connection.js";
import { find, make, say, show } from "./dom.js";
import { Drawing } from "./drawing.js";
import { Events } from "./events.js";
import { since } from "./format.js";
import { Model } from "./model.js";
import { Scope } from "./scope.js";
import { Status } from "./status.js";
import { words } from "./words.js";

const OLD = 1000; // ms after which what is shown is old

const connection = new Connection();
const model = new Model(connection);
const status = new Status(model);
const drawing = new Drawing(find("#drawing"), find("#hint"), find("#colours"), model);
const scope = new Scope(find("#scope"), connection, model);
const block = new Block(find("#block"), connection, model);
const camera = new Camera(connection, model);
const events = new Events(connection, refuse);
let loaded = ""; // the application that is shown, with its variant and hash
let watched = "";

/** Show why something was refused, for a while. */
function refuse(sentence) {
  const box = find("#refusal");
  say(box, sentence);
  show(box, true);
  clearTimeout(refuse.timer);
  refuse.timer = setTimeout(() => show(box, false), 8000);
}

async function ask(verb, args) {
  try {
    return await connection.request(verb, args);
  } catch (error) {
    refuse(error.message);
    return null;
  }
}

/** Show another application, or the same one after the connection was lost. */
async function begin(key) {
  if (!connection.may("drawing")) return;
  const other = loaded !== "" && loaded !== key;
  loaded = key;
  if (other || !drawing.svg) drawing.clear("the target draws the diagram");
  try {
    const picture = connection.request("drawing");
    picture.catch(() => {});
    await model.load();
    const modes = await status.begin();
    watch(modes);
    scope.renew(true);
    if (block.path && model.kinds.has(block.path)) block.open(block.path);
    else block.close();
    findWords();
    drawing.take(await picture); // which takes a while when it is the first one to be asked for
    watch([...modes, ...camera.begin(drawing.pictures)]);
    mark();
    show(find("#zoom"), true);
  } catch (error) {
    loaded = "";
    if (connection.hello) refuse(error.message);
  }
}

/** Find what the numbers of modes and reasons mean. */
async function findWords() {
  for (const signal of status.modes.filter((each) => each.type === "int64")) {
    const found = await model.describe(signal.block).catch(() => ({ doc: "" }));
    const meaning = words(signal.port, signal.doc, found.doc);
    if (meaning.size) signal.words = meaning;
  }
}

/** Have the values of wires, modes, ages, and of the block that is open. */
function watch(modes = watch.modes ?? []) {
  watch.modes = modes;
  const outputs = block.path ? [...model.signals.values()].filter((each) => each.path === block.path && each.type !== "frame") : [];
  const names = [...new Set([...modes, ...outputs.map((each) => each.name), ...scope.signals, ...drawing.sources])].slice(0, 1000);
  if (names.join() === watched || !names.length) return;
  watched = names.join();
  connection.request("watch", { names }).catch(() => (watched = ""));
}

connection.on("hello", () => {
  loaded = watched = "";
  const { target, level } = connection.hello;
  document.title = `${target}: quadvis`;
  document.body.dataset.level = level;
  events.begin().catch(() => {});
  applications();
});

async function applications() {
  const choice = find("#choice");
  const names = connection.may("load") ? ((await ask("applications")) ?? []).map((each) => each.name ?? each) : [];
  for (const each of [choice, find("#load")]) show(each, names.length > 1 || (names.length > 0 && !model.status.Application));
  choice.replaceChildren(...names.map((name) => make("option", { textContent: name, selected: name === model.status.Application })));
}

connection.on("state", ({ data }) => {
  const running = data.Status === "running";
  const before = model.status.Status;
  model.status = data;
  say(find("#application"), data.Application || "nothing is loaded");
  say(find("#state"), data.Status);
  find("#state").dataset.state = data.CPUOverload === "detected" && running ? "overrun" : data.Status;
  say(find("#clock"), clock(data));
  say(find("#operator"), data.Operator ? `operator: ${data.Operator}` : "");
  show(find("#stop"), connection.may("stop") && (running || data.Status === "stopping"));
  show(find("#start"), connection.may("start") && Boolean(data.Application) && !running && data.Status !== "stopping");
  status.take(data);
  drawing.ring(status.ringed);
  const key = `${data.Application} ${data.Variant} ${data.Hash}`;
  if (data.Application && key !== loaded) begin(key);
  else if (before && before !== data.Status) {
    if (running) scope.renew();
    if (data.Status === "stopped") events.begin().catch(() => {});
  }
});

function clock({ Application, ExecTime, StopTime }) {
  if (!Application) return "";
  const end = StopTime > 0 && StopTime < 1e9 ? ` of ${StopTime.toFixed(0)} s` : " s";
  return `${(ExecTime ?? 0).toFixed(1)}${end}`;
}

connection.on("watched", ({ data }) => (model.watched = data));

connection.on("values", ({ data, samples }) => {
  if (!model.take(data, samples)) return;
  scope.takeValues();
  if (frame === null) frame = requestAnimationFrame(showValues);
});

let frame = null; // in which the newest values are shown

function showValues() {
  frame = null;
  model.shown = performance.now();
  drawing.update();
  status.values();
  block.update();
}

connection.on("event", ({ data }) => {
  events.add(data);
  if (data.event === "tuned" && connection.may("parameters")) model.loadParameters().catch(() => {});
  if (data.event === "loaded" || data.event === "unloaded") applications();
});
connection.on("lost", () => {
  if (connection.refused) refuse(connection.refused);
});

// Old data is greyed, with the time since.
let greyed = null; // until there was something to see
setInterval(() => {
  const silent = performance.now() - connection.heard;
  const old = !connection.hello || silent > OLD;
  const text = !old ? "" : Number.isFinite(silent) ? `no news for ${since(silent / 1000)}` : "waiting for the target";
  document.body.dataset.connection = old ? "old" : "live";
  say(find("#connection"), text || (connection.dropped ? `${connection.dropped} message${connection.dropped === 1 ? "" : "s"} dropped` : ""));
  if (greyed !== null && old !== greyed) events.add({ event: old ? "the connection is lost" : "the connection is back" }, true);
  if (greyed !== null || !old) greyed = old;
}, 100);

find("#start").onclick = () => ask("start");
find("#stop").onclick = () => ask("stop");
find("#load").onclick = async () => {
  await ask("load", { application: find("#choice").value });
};

drawing.onwire = (source) => {
  const signal = model.signalOf(source);
  if (signal && signal.type !== "frame") scope.toggle(signal.name);
};
drawing.onblock = (path) => (path === block.path ? block.close() : block.open(path).then(mark), mark());
block.onclose = () => mark();
block.onsignal = (name) => scope.toggle(name);
scope.onchange = () => mark();
scope.onrefusal = refuse;

function mark() {
  drawing.mark(new Set(scope.signals), block.path);
  watch();
}

for (const button of document.querySelectorAll("[data-zoom]")) {
  const factor = { in: 1.4, out: 1 / 1.4 }[button.dataset.zoom];
  button.onclick = () => (factor ? drawing.view.zoom(factor) : drawing.view.fit());
}

addEventListener("keydown", (event) => {
  if (/^(?:INPUT|SELECT|TEXTAREA)$/.test(event.target.tagName)) return;
  if (event.key === " " && scope.isOpen && event.target.tagName !== "BUTTON") {
    event.preventDefault();
    scope.pause();
  } else if (event.key === "Escape") {
    if (block.path) block.close();
    else if (scope.isOpen) scope.close();
  }
});

export const page = { connection, model, drawing, scope, block };
