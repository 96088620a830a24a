/** Numbers and names as the page shows them. */

const GROUPS = new Intl.NumberFormat("en-US");

/** A count: 226,800. */
export const count = (value) => GROUPS.format(value);

/** A number of things: "1 design", "2 designs". */
export const countOf = (value, noun) => `${count(value)} ${noun}${value === 1 ? "" : "s"}`;

/** A number with at most `digits` digits, as the command line prints it; "–" if undefined. */
export function number(value, digits = 6) {
  if (Number.isNaN(value)) return "–";
  if (value === 0 || !Number.isFinite(value)) return String(value).replace("-", "−");
  const size = Math.abs(value);
  const text =
    size < 1e-4 || size >= 10 ** digits
      ? value
          .toExponential(digits - 1)
          .replace(/\.?0+e/, "e")
          .replace("e+", "e")
      : String(Number(value.toPrecision(digits)));
  return text.replace(/-/g, "−");
}

/** A formatter of ticks with at least `least` digits, and as many as make them differ. */
export function tickText(values, least) {
  const size = Math.max(...values.map(Math.abs)),
    step = Math.abs(values[1] - values[0]);
  const digits = values.length > 1 && step > 0 ? Math.ceil(Math.log10(size / step)) + 2 : 0;
  return (value) => number(value, Math.min(15, Math.max(least, digits)));
}

/** A value of a column: a label, a whole number or a number. */
export function cell(column, value, digits = 6) {
  if (column.labels) return column.verbatim ? column.labels[value] : words(column.labels[value] ?? String(value));
  return column.whole && Number.isFinite(value) ? String(value).replace("-", "−") : number(value, digits);
}

/** A design as the page names it, with its file if the page has several. */
export const designName = ({ study, designs, byName }, row) =>
  study.files ? `${count(designs[row])} of ${study.files[byName.get("results").values[row]].name}` : count(designs[row]);

/** A column's name in words. */
export const words = (name) => name.replaceAll("_", " ");

/** A unit with its powers raised: mm². */
export const raised = (unit) => unit.replace(/\^(\d)/g, (_, power) => "⁰¹²³⁴⁵⁶⁷⁸⁹"[power]);

/** A column's name with its unit. */
export const titled = (column) => (column.unit ? `${words(column.name)} [${column.unit}]` : words(column.name));
