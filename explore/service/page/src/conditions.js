/** The conditions that designs have to meet: a range of each of some columns, both ends included. */

export class Conditions {
  /** @param {Array<Object>} sources the results; the constraints of the first are the first conditions */
  constructor([first]) {
    this.first = first;
    /** @type {Map<string, {low: number, high: number}>} infinite where open */
    this.ranges = new Map();
    this.listeners = [];
    this.constrain();
  }

  /** Call after each change. */
  listen(listener) {
    this.listeners.push(listener);
  }

  /** The range of a column. */
  of(name) {
    return this.ranges.get(name) ?? { low: -Infinity, high: Infinity };
  }

  /** Set the range of a column; an open one removes its condition. */
  set(name, low, high) {
    const before = this.of(name);
    if (before.low === low && before.high === high) return;
    if (low === -Infinity && high === Infinity) this.ranges.delete(name);
    else this.ranges.set(name, { low, high });
    this.change();
  }

  /** Remove all conditions. */
  clear() {
    this.ranges.clear();
    this.change();
  }

  /** The constraints of the study, and no others. */
  reset() {
    this.ranges.clear();
    this.constrain();
    this.change();
  }

  constrain() {
    for (const { metric, kind, limit } of this.first.constraints) {
      if (!this.first.byName.has(metric)) continue;
      const { low, high } = this.of(metric);
      this.ranges.set(metric, kind === "min" ? { low: limit, high } : { low, high: limit });
    }
  }

  change() {
    for (const listener of this.listeners) listener(this);
  }

  /** Conditions as the command line writes them, of the columns that results have. */
  texts({ byName }) {
    return [...this.ranges]
      .filter(([name]) => byName.has(name))
      .flatMap(([name, { low, high }]) => [
        ...(low > -Infinity ? [`${name} >= ${low}`] : []),
        ...(high < Infinity ? [`${name} <= ${high}`] : []),
      ]);
  }
}
