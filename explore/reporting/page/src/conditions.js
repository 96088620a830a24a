/** Conditions as text: short decimal bounds, and the line for the command line that selects the same designs. */

/** What `--where` reads as a name: it must be one word, and none of its own. */
const WORD = /^[\p{L}_][\p{L}\p{N}_]*$/u;
const OWN = ["and", "or", "not"];

/**
 * A bound with as few digits as its place on the screen needs, moved outwards by less than a pixel.
 * @param {number} value
 * @param {number} pixel what a pixel is worth there
 * @param {boolean} up whether to move up
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
export const nameable = (name) => WORD.test(name) && !OWN.includes(name);

/**
 * The text of `--where` for conditions; JavaScript and Python write the shortest digits that give the same double.
 * @param {import("./selection.js").Condition[]} conditions
 */
export function whereText(conditions) {
  return conditions
    .filter(({ column }) => nameable(column))
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
