/** Axes: range, linear or logarithmic scale, and ticks. */

import { scaleLinear, scaleLog } from "d3-scale";
import { cell, tickText } from "./format.js";

/** Share of the designs beyond each end of an axis without outliers. */
const TAIL = 0.005;
/** Values with a smaller relative difference are equal up to rounding, such as those of a length that is solved for. */
const ROUNDING = 1e-13;

/**
 * What an axis spans.
 * @param {import("./payload.js").Column} column
 * @param {Uint8Array} kinds
 * @param {{log: boolean, all: boolean}} options `all` leaves no feasible or infeasible design outside
 * @returns {?[number, number]} null when no value can be shown
 */
export function extent(column, kinds, { log, all }) {
  // All values of a parameter were asked for, and codes are few.
  if (column.role === "parameter" || column.labels) all = true;
  const shown = (value) => Number.isFinite(value) && (!log || value > 0);
  let low = Infinity,
    high = -Infinity;
  const include = (value) => {
    low = Math.min(low, value);
    high = Math.max(high, value);
  };
  const bulk = [];
  for (let i = 0; i < kinds.length; i++) {
    const value = column.values[i];
    if (!shown(value)) continue;
    if (all || kinds[i] === 2) include(value);
    else if (kinds[i] === 1) bulk.push(value);
  }
  if (!all && bulk.length) {
    const sorted = Float64Array.from(bulk).sort();
    include(sorted[Math.floor(TAIL * (sorted.length - 1))]);
    include(sorted[Math.ceil((1 - TAIL) * (sorted.length - 1))]);
  }
  // Marks of one code are spread around it.
  if (column.labels && low <= high) return log ? null : [low - 0.5, high + 0.5];
  if (low > high) return all ? null : extent(column, kinds, { log, all: true });
  return [low, high];
}

/** Scale from an extent with a margin to pixels. */
export function axisScale(span, range, { log = false, room = 0 } = {}) {
  let [low, high] = span;
  if (high - low <= ROUNDING * Math.max(Math.abs(low), Math.abs(high)))
    [low, high] = log
      ? [low / 1.5, low * 1.5]
      : [low - (Math.abs(low) || 1) * 0.05, high + (Math.abs(high) || 1) * 0.05];
  if (log) {
    const factor = (high / low) ** room;
    return scaleLog([low / factor, high * factor], range);
  }
  const more = (high - low) * room;
  return scaleLinear([low - more, high + more], range);
}

/** Ticks of an axis and their text: labels of a column of codes, short numbers of others; none on an empty axis. */
export function tickMarks(scale, column, wanted, span) {
  if (!span) return { values: [], text: String };
  if (column.labels) {
    const [low, high] = scale.domain();
    const codes = Object.keys(column.labels)
      .map(Number)
      .filter((code) => code >= low && code <= high);
    return { values: codes, text: (code) => cell(column, code) };
  }
  let values = scale.ticks(wanted);
  if (scale.base && values.length > wanted) {
    const thinned = values.filter((_, k) => k % Math.ceil(values.length / wanted) === 0);
    const round = [["1"], ["1", "2", "5"]].map((digits) => values.filter((value) => digits.includes(mantissa(value))));
    values = round.find((some) => some.length > 1 && some.length <= wanted) ?? thinned;
  }
  return { values, text: tickText(values, 6) };
}

/** The digits of a number without its power of ten: "1" of 0.01 and of 100. */
const mantissa = (value) => Number(value.toPrecision(12)).toExponential().split("e")[0];
