// A small graph of the last values of a signal.

import { colours } from "./colours.js";

/** Draw the past of a signal on a canvas; its elements share the scale. */
export function draw(canvas, past) {
  const context = canvas.getContext("2d");
  const { width, height } = canvas;
  context.clearRect(0, 0, width, height);
  if (!past) return;
  const lines = Array.from({ length: past.width }, (_, element) => [...past.of(element)]);
  const numbers = lines.flat().filter(Number.isFinite);
  if (!numbers.length) return;
  const [least, most] = [Math.min(...numbers), Math.max(...numbers)];
  const span = most - least || 1;
  const y = (number) => height - 3 - ((number - least) / span) * (height - 6) * (most > least) - (most === least) * (height / 2 - 3);
  const palette = colours();
  lines.forEach((line, element) => {
    context.strokeStyle = palette[element % palette.length];
    context.lineWidth = 1.25;
    context.beginPath();
    let down = false;
    line.forEach((number, index) => {
      if (!Number.isFinite(number)) down = false;
      else {
        const x = (index / Math.max(1, line.length - 1)) * width;
        if (down) context.lineTo(x, y(number));
        else context.moveTo(x, y(number));
        down = true;
      }
    });
    context.stroke();
  });
}
