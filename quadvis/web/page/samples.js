// The samples of a scope: a bounded past that can be drawn, with gaps where something is missing.

export const MOST = 10_000; // points of a curve

export class Samples {
  /** Keep `width` curves. */
  constructor(width) {
    this.width = width;
    this.count = 0;
    this.columns = Array.from({ length: width + 1 }, () => new Float64Array(2 * MOST));
    this.period = Infinity; // between two samples, the shortest seen
  }

  clear() {
    this.count = 0;
  }

  get end() {
    return this.count ? this.columns[0][this.count - 1] : NaN;
  }

  /** Add rows of time and values; a jump in time becomes a gap. */
  add(rows) {
    const step = this.width + 1;
    for (let at = 0; at < rows.length; at += step) {
      const time = rows[at];
      const passed = time - this.end;
      if (passed < 0) this.clear(); // another run
      if (passed > 1e-9 && passed < this.period) this.period = passed;
      if (passed > 2.5 * this.period) this.#put(this.end + this.period, null, 0);
      this.#put(time, rows, at + 1);
    }
  }

  #put(time, rows, at) {
    if (this.count === 2 * MOST) {
      for (const column of this.columns) column.copyWithin(0, MOST);
      this.count = MOST;
    }
    this.columns[0][this.count] = time;
    for (let index = 0; index < this.width; index++) this.columns[index + 1][this.count] = rows ? rows[at + index] : NaN;
    this.count++;
  }

  /** Return the curves from one time to another as lists: times, and values with null for what is missing. */
  between(from, to) {
    const times = this.columns[0];
    let first = this.count;
    while (first > 0 && times[first - 1] >= from) first--;
    let last = first;
    while (last < this.count && times[last] <= to) last++;
    first = Math.max(first, last - MOST);
    return this.columns.map((column) => Array.from(column.subarray(first, last), (each) => (Number.isNaN(each) ? null : each)));
  }
}
