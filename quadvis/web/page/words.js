// What the numbers of a signal mean, from the documentation of its port or its block.

/** Return words by number from a text such as "state: 0 FRESH, 1 COAST", or an empty map. */
function inLine(doc) {
  const found = new Map();
  for (const [, number, word] of doc.matchAll(/(?:^|[,;:] )(\d+) ([A-Za-z][^,;:]*)/g)) {
    if (!/^to \d/.test(word)) found.set(Number(number), word.trim());
  }
  return found.size >= 2 && found.has(0) ? found : new Map();
}

/** Return words by number from the table in a block's documentation whose head is the name of the port. */
function inTable(port, doc) {
  const found = new Map();
  let inside = false;
  for (const line of doc.split("\n")) {
    if (new RegExp(`^${port} +\\w`).test(line)) inside = true;
    const row = inside && line.match(/^(\d+) +(.+)$/);
    if (row) found.set(Number(row[1]), row[2].trim());
    else if (inside && found.size && !/^[= ]*$/.test(line)) inside = false;
  }
  return found;
}

/** Return words by number for a port; empty if the documentation has none. */
export function words(port, doc, blockDoc) {
  const table = inTable(port, blockDoc);
  return table.size ? table : inLine(doc);
}
