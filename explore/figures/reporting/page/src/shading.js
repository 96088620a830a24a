/** Colours of designs by the value of a column. */

import { ramp } from "./marks.js";
import { colours } from "./theme.js";

/** Colours that a scale is divided into. */
const SHADES = 64;

/**
 * The colour of each row by a column, from one end of a span to the other; what lies beyond has that of the end.
 * @param {Float64Array} values
 * @param {?[number, number]} span
 * @returns {{least: number, most: number, of: (row: number) => string}}
 */
export function shading(values, span) {
  const [least, most] = span ?? [0, 0];
  const { muted, ramp: anchors } = colours();
  const shades = ramp(anchors.split(", "), SHADES);
  const scale = most > least ? (SHADES - 1) / (most - least) : 0;
  const within = (value) => Math.min(most, Math.max(least, value));
  const of = (row) =>
    Number.isFinite(values[row]) ? shades[Math.round((within(values[row]) - least) * scale)] : muted;
  return { least, most, of };
}
