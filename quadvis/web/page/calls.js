// How long the calls of a block take, measured on a click while the application flies on.

import { make, say } from "./dom.js";
import { time } from "./format.js";

const LASTS = 2; // s

const COLUMNS = ["", "mean", "max", "share"];

/** Return a button, and the room for what it finds of the block at a path; it measures all blocks, and shows this one. */
export function calls(connection, path) {
  const room = make("div", { className: "calls" });
  const button = make("button", { type: "button", textContent: "Time its calls", title: `for ${LASTS} s; meanwhile each call takes a little longer` });
  button.onclick = async () => {
    button.disabled = true;
    say(room, "measuring \u2026");
    try {
      await connection.request("startprofiler");
      await new Promise((resolve) => setTimeout(resolve, 1000 * LASTS));
      await connection.request("stopprofiler");
      room.replaceChildren(table(await connection.request("getprofilerdata"), path));
    } catch (error) {
      say(room, error.message);
    }
    button.disabled = false;
  };
  return [button, room];
}

/** Return the times of the methods of a block; the share is that of its computer's calls. */
function table({ blocks }, path) {
  for (const { methods } of blocks) {
    const whole = methods.reduce((sum, [, , , , total]) => sum + total, 0);
    const own = methods.filter(([block]) => block === path);
    if (!own.length) continue;
    const rows = own.map(([, method, , count, total, , most]) => [method, time(total / count), time(most), `${(100 * total / whole).toFixed(1)} %`]);
    return make("table", {}, ...[COLUMNS, ...rows].map((row, number) => make("tr", {}, ...row.map((text) => make(number ? "td" : "th", { textContent: text })))));
  }
  return make("p", { className: "note", textContent: "it was not called meanwhile" });
}
