/** The selection as CSV: the shortest digits that give the same doubles again, empty where undefined. */

/** @param {import("./payload.js").Model} model @param {Iterable<number>} rows */
export function csvText(model, rows) {
  const lines = [["design", ...model.columns.map((column) => column.name)].map(quoted).join(",")];
  for (const row of rows) {
    lines.push([model.designs[row], ...model.columns.map((column) => text(column, column.values[row]))].join(","));
  }
  return `${lines.join("\n")}\n`;
}

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

/** Let the browser save a text as a file. */
export function save(name, content) {
  const address = URL.createObjectURL(new Blob([content], { type: "text/csv" }));
  const link = document.createElement("a");
  link.href = address;
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(address), 10_000);
}
