/** The selection as CSV: numbers in the shortest digits that give the same double, empty cells where undefined, labels beside codes. */

/** @param {import("./payload.js").Model} model @param {Iterable<number>} rows */
export function csvText(model, rows) {
  const names = model.columns.flatMap(({ name, heading = name, labels }) => (labels ? [heading, `${name}_label`] : [heading]));
  const lines = [["design", ...names].map(quoted).join(",")];
  for (const row of rows) {
    lines.push([model.designs[row], ...model.columns.flatMap((column) => cells(column, column.values[row]))].join(","));
  }
  return `${lines.join("\n")}\n`;
}

const cells = (column, value) =>
  column.labels ? [text(column, value), quoted(column.labels[value] ?? String(value))] : [text(column, value)];

function text(column, value) {
  if (column.name === "feasible") return value ? "True" : "False";
  if (Number.isNaN(value)) return "";
  if (column.whole) return String(value);
  if (!Number.isFinite(value)) return value > 0 ? "inf" : "-inf";
  return Object.is(value, -0)
    ? "-0.0"
    : Number.isInteger(value) && Math.abs(value) < 1e21
      ? `${value}.0`
      : String(value);
}

const quoted = (name) => (/[",\r\n]/.test(name) ? `"${name.replaceAll('"', '""')}"` : name);

/** Save a text as a file. */
export function save(name, content, type = "text/csv") {
  const address = URL.createObjectURL(new Blob([content], { type }));
  const link = document.createElement("a");
  link.href = address;
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(address), 10_000);
}
