/** The selection: the designs that meet the conditions of all brushes and fields. */

/** @typedef {{column: string, low: number, high: number}} Condition both ends included; infinite if open */

export class Selection {
  /** @param {import("./payload.js").Model} model */
  constructor(model) {
    this.model = model;
    this.mask = new Uint8Array(model.size).fill(1);
    this.counts = [0, 0, 0];
    this.least = 0;
    /** @type {Map<string, Condition[]>} */
    this.brushes = new Map();
    this.listeners = [];
    this.count();
  }

  /** Call with this selection after each change. */
  listen(listener) {
    this.listeners.push(listener);
  }

  /** Set the conditions of one brush; none removes it. */
  set(key, conditions) {
    if (conditions.length) this.brushes.set(key, conditions);
    else if (!this.brushes.delete(key)) return;
    this.change();
  }

  /** Take only designs of this kind or better: FEASIBLE or FRONT; 0 takes all. */
  takeKind(least) {
    this.least = least;
    this.change();
  }

  /** Take all designs again. */
  clear() {
    this.brushes.clear();
    this.least = 0;
    this.change();
  }

  get total() {
    return this.counts[0] + this.counts[1] + this.counts[2];
  }

  get active() {
    return this.brushes.size > 0 || this.least > 0;
  }

  /** All conditions of all brushes. */
  conditions() {
    return [...this.brushes.values()].flat();
  }

  change() {
    const { mask, model, least } = this;
    for (let i = 0; i < mask.length; i++) mask[i] = model.kinds[i] >= least ? 1 : 0;
    for (const { column, low, high } of this.conditions()) {
      const values = model.byName.get(column).values;
      // False for NaN, so an undefined value meets no condition, as on the command line.
      for (let i = 0; i < mask.length; i++) mask[i] &= values[i] >= low && values[i] <= high;
    }
    this.count();
    for (const listener of this.listeners) listener(this);
  }

  count() {
    this.counts = [0, 0, 0];
    for (let i = 0; i < this.mask.length; i++) this.counts[this.model.kinds[i]] += this.mask[i];
  }
}

/** One design or none, such as the chosen one; listeners are called after each change. */
export class Focus {
  constructor(row = -1) {
    this.row = row;
    this.listeners = [];
  }

  listen(listener) {
    this.listeners.push(listener);
  }

  set(row) {
    if (row === this.row) return;
    this.row = row;
    for (const listener of this.listeners) listener(row);
  }
}
