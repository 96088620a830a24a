/** Conditions as text: short decimal bounds, and the command that selects the same designs. */

/** A name that `--where` can read: one word that is not a keyword of its conditions. */
const WORD = /^[\p{L}_][\p{L}\p{N}_]*$/u;
const KEYWORDS = ["and", "or", "not"];

/**
 * A bound rounded outwards by less than a pixel to as few digits as possible.
 * @param {number} value
 * @param {number} pixel width of a pixel in the unit of the value
 * @param {boolean} up whether to round up
 */
export function shortBound(value, pixel, up) {
  const digits = -Math.floor(Math.log10(pixel));
  if (!Number.isFinite(digits) || digits > 300) return value;
  const step = 10 ** Math.abs(digits);
  const round = up ? Math.ceil : Math.floor;
  const scaled = digits >= 0 ? round(value * step) / step : round(value / step) * step;
  const short = Number(scaled.toPrecision(15));
  return (up ? short >= value : short <= value) ? short : value;
}

/** Whether the command line can name this column. */
export const isNameable = (name) => WORD.test(name) && !KEYWORDS.includes(name);

/**
 * The text of `--where` for conditions; JavaScript and Python write the shortest digits that give the same double.
 * @param {import("./selection.js").Condition[]} conditions
 */
export function whereText(conditions) {
  return conditions
    .filter(({ column }) => isNameable(column))
    .map(oneText)
    .join(" and ");
}

function oneText({ column, low, high }) {
  if (low === high) return `${column} == ${low}`;
  if (low === -Infinity) return `${column} <= ${high}`;
  if (high === Infinity) return `${column} >= ${low}`;
  return `${low} <= ${column} <= ${high}`;
}

/**
 * The command that ranks the designs of a selection.
 * @param {string} command without a condition
 */
export function commandLine(command, conditions) {
  const text = whereText(conditions);
  return text ? `${command} --where "${text}"` : command;
}
