// Pan and zoom of a drawing: wheel, drag, two fingers, keys.

const MOST = 12; // times larger than all of it

export class View {
  #points = new Map();
  #moved = 0;
  #touched = false; // by a person, who now decides what is in view

  constructor(frame, changed = () => {}) {
    this.frame = frame;
    this.changed = changed;
    frame.addEventListener("wheel", (event) => this.#wheel(event), { passive: false });
    frame.addEventListener("pointerdown", (event) => this.#down(event));
    frame.addEventListener("pointermove", (event) => this.#move(event));
    for (const name of ["pointerup", "pointercancel", "pointerleave"]) {
      frame.addEventListener(name, (event) => this.#points.delete(event.pointerId));
    }
    frame.addEventListener("keydown", (event) => this.#key(event));
    new ResizeObserver(() => (this.#touched ? this.#apply() : this.fit())).observe(frame);
  }

  /** Show a drawing that fills a box, in user units. */
  take(svg, { x, y, width, height }) {
    this.svg = svg;
    const edge = 0.015 * width;
    this.box = { x: x - edge, y: y - edge, width: width + 2 * edge, height: height + 2 * edge };
    this.fit();
  }

  fit() {
    this.#touched = false;
    const { clientWidth: width, clientHeight: height } = this.frame;
    if (!this.svg || !width || !height) return;
    const { box } = this;
    // A wide drawing on a narrow screen begins at its left end, legible.
    const whole = Math.min(width / box.width, height / box.height);
    this.least = whole;
    this.scale = width < 700 ? Math.max(whole, Math.min(0.55, height / box.height)) : whole;
    this.x = this.scale > whole ? box.x : box.x + (box.width - width / this.scale) / 2;
    this.y = box.y + (box.height - height / this.scale) / 2;
    this.#apply();
  }

  /** Zoom by a factor about a point of the frame, in CSS pixels. */
  zoom(factor, x = this.frame.clientWidth / 2, y = this.frame.clientHeight / 2) {
    const scale = Math.min(Math.max(this.scale * factor, this.least / 1.5), Math.max(4, this.least * MOST));
    this.x += x / this.scale - x / scale;
    this.y += y / this.scale - y / scale;
    this.scale = scale;
    this.#touched = true;
    this.#apply();
  }

  /** Whether the last press was a drag and no click. */
  get dragged() {
    return this.#moved > 6;
  }

  #apply() {
    if (!this.svg) return;
    const { clientWidth: width, clientHeight: height } = this.frame;
    this.svg.setAttribute("viewBox", `${this.x} ${this.y} ${width / this.scale} ${height / this.scale}`);
    this.changed();
  }

  #wheel(event) {
    if (!this.svg) return;
    event.preventDefault();
    const { left, top } = this.frame.getBoundingClientRect();
    this.zoom(Math.exp(-event.deltaY * (event.deltaMode ? 0.05 : 0.0015)), event.clientX - left, event.clientY - top);
  }

  #down(event) {
    if (!this.#points.size) this.#moved = 0;
    this.#points.set(event.pointerId, event);
  }

  #move(event) {
    const last = this.#points.get(event.pointerId);
    if (!last || !this.svg) return;
    const [dx, dy] = [event.clientX - last.clientX, event.clientY - last.clientY];
    this.#moved += Math.abs(dx) + Math.abs(dy);
    if (this.dragged && !this.frame.hasPointerCapture(event.pointerId)) this.frame.setPointerCapture(event.pointerId);
    const other = [...this.#points.values()].find((each) => each.pointerId !== event.pointerId);
    if (other) {
      const { left, top } = this.frame.getBoundingClientRect();
      const apart = (point) => Math.hypot(point.clientX - other.clientX, point.clientY - other.clientY) || 1;
      const middle = [(event.clientX + other.clientX) / 2 - left, (event.clientY + other.clientY) / 2 - top];
      this.x -= dx / 2 / this.scale;
      this.y -= dy / 2 / this.scale;
      this.zoom(apart(event) / apart(last), ...middle);
    } else if (this.dragged) {
      this.#touched = true;
      this.x -= dx / this.scale;
      this.y -= dy / this.scale;
      this.#apply();
    }
    this.#points.set(event.pointerId, event);
  }

  #key(event) {
    const step = 60 / this.scale;
    const moves = { ArrowLeft: [-step, 0], ArrowRight: [step, 0], ArrowUp: [0, -step], ArrowDown: [0, step] };
    if (event.key in moves) {
      this.#touched = true;
      this.x += moves[event.key][0];
      this.y += moves[event.key][1];
      this.#apply();
    } else if (event.key === "+" || event.key === "=") this.zoom(1.25);
    else if (event.key === "-") this.zoom(0.8);
    else if (event.key === "0") this.fit();
    else return;
    event.preventDefault();
  }
}
