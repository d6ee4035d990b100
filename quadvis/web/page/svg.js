// The drawing of a target as elements: only what a drawing needs is taken over.

export const NS = "http://www.w3.org/2000/svg";
const ELEMENTS = new Set(["svg", "g", "rect", "text", "tspan", "title", "line", "polyline", "polygon", "path", "circle", "ellipse"]);
const ATTRIBUTES = /^(?:id|class|x|y|x1|y1|x2|y2|dx|dy|cx|cy|r|rx|ry|d|points|width|height|viewBox|transform|fill|stroke|opacity|role|data-[\w-]+|(?:fill|stroke|font|text|dominant)-[\w-]+)$/;

/** Return a copy of an element in this document, without scripts, links and handlers. */
function copy(element) {
  const made = document.createElementNS(NS, element.localName);
  for (const { name, value } of element.attributes) {
    if (ATTRIBUTES.test(name) && !/url\s*\(/i.test(value)) made.setAttribute(name, value);
  }
  for (const child of element.childNodes) {
    if (child.nodeType === Node.TEXT_NODE) made.append(child.data);
    else if (ELEMENTS.has(child.localName)) made.append(copy(child));
  }
  return made;
}

/** Return the root element of a drawing. */
export function readDrawing(text) {
  const root = new DOMParser().parseFromString(text, "image/svg+xml").documentElement;
  if (root.localName !== "svg") throw new Error("the drawing cannot be read");
  return copy(root);
}

export function makeSvg(tag, attributes = {}) {
  const made = document.createElementNS(NS, tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  return made;
}
