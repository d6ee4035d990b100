// Values as short texts.

const MINUS = "\u2212";
const MOST = 4; // numbers of a vector that are shown

/** Return a number as a text of about four digits, which does not jump in length. */
export function number(value) {
  if (typeof value === "string") return value === "NaN" ? "missing" : value.replace("Infinity", "\u221e").replace("-", MINUS);
  const size = Math.abs(value);
  let text;
  if (size === 0) text = "0";
  else if (size >= 1e6 || size < 5e-4) text = value.toExponential(1).replace("e+", "e");
  else if (Number.isInteger(value) && size >= 1000) text = value.toFixed(0);
  else text = value.toFixed(size >= 1000 ? 0 : size >= 100 ? 1 : size >= 10 ? 2 : 3);
  return text.replaceAll("-", MINUS);
}

/** Return a unit as it is printed: "m/s\u00b2" for "m/s^2", "" for "1". */
export function unit(text) {
  const powers = { "-": "\u207b", ".": "\u22c5", 0: "\u2070", 1: "\u00b9", 2: "\u00b2", 3: "\u00b3", 4: "\u2074", 5: "\u2075", 6: "\u2076", 7: "\u2077", 8: "\u2078", 9: "\u2079" };
  if (!text || text === "1") return "";
  return text.replace(/\^(-?[\d.]+)/g, (_, power) => [...power].map((each) => powers[each]).join(""));
}

const whole = (type) => type === "int64" || type === "bool";

function one(value, type, words) {
  if (type === "bool") return value ? "yes" : "no";
  if (words && words.has(value)) return words.get(value);
  return whole(type) && typeof value === "number" ? String(value).replace("-", MINUS) : number(value);
}

const flat = (value) => (Array.isArray(value) ? value.flat(Infinity) : [value]);

/** Return the value of a signal with its unit, of at most `most` numbers. */
export function value(signal, found, most = MOST) {
  if (found === null || found === undefined) return "";
  const suffix = unit(signal.unit) && ` ${unit(signal.unit)}`;
  const numbers = flat(found);
  if (!Array.isArray(found)) return one(found, signal.type, signal.words) + suffix;
  if (signal.type === "bool") return numbers.map((each) => (each ? "\u25cf" : "\u25cb")).join("");
  const shown = numbers.slice(0, most).map((each) => one(each, signal.type)).join(" ");
  return `[${shown}${numbers.length > most ? ` \u2026 (${numbers.length})` : ""}]${suffix}`;
}

/** Return a time in seconds in a fitting unit: "12.3 \u00b5s". */
export function time(seconds) {
  const [factor, name] = seconds >= 1 ? [1, "s"] : seconds >= 1e-3 ? [1e3, "ms"] : [1e6, "\u00b5s"];
  const scaled = seconds * factor;
  return `${scaled.toFixed(scaled >= 100 ? 0 : scaled >= 10 ? 1 : 2)} ${name}`;
}

/** Return a time since something: "3 s", "2 min 5 s". */
export function since(seconds) {
  const whole = Math.floor(seconds);
  return whole < 60 ? `${whole} s` : `${Math.floor(whole / 60)} min ${whole % 60} s`;
}

export function bytes(count) {
  return count < 1e6 ? `${Math.max(1, Math.round(count / 1e3))} kB` : `${(count / 1e6).toFixed(1)} MB`;
}
