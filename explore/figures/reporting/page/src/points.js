/** Pixels and marks of the designs in the scatter: at most one mark of a style per pixel. */

import { fileColours, fileMarks, isByFile } from "./files.js";
import { kindColour, mark } from "./marks.js";
import { extent } from "./scales.js";
import { shading } from "./shading.js";
import { colours } from "./theme.js";

/**
 * Pixels of all designs, NaN where a design is not drawn.
 * @returns {{x: Float32Array, y: Float32Array, missingX: number, missingY: number, missingBoth: number, outside: number}}
 */
export function place(model, view, gutterX, gutterY) {
  const n = model.size,
    x = new Float32Array(n),
    y = new Float32Array(n);
  const [columnX, columnY] = [model.byName.get(view.x), model.byName.get(view.y)];
  const found = {
    x,
    y,
    width: view.width,
    height: view.height,
    missingX: 0,
    missingY: 0,
    missingBoth: 0,
    outside: 0,
    missingColour: 0,
  };
  const [atX, atY] = [placer(columnX, view.scaleX), placer(columnY, view.scaleY)];
  for (let i = 0; i < n; i++) {
    const px = atX(i),
      py = atY(i);
    const noX = Number.isNaN(px),
      noY = Number.isNaN(py);
    if (noX && noY) found.missingBoth++;
    else if (noX) found.missingX++;
    else if (noY) found.missingY++;
    const out = (!noX && outside(px, view.scaleX)) || (!noY && outside(py, view.scaleY));
    if (out) found.outside++;
    x[i] = out || (noX && noY) ? NaN : noX ? gutterX - 3 + scattered(i) * 10 : px;
    y[i] = out || (noX && noY) ? NaN : noY ? gutterY + 3 + scattered(i) * 10 : py;
  }
  return found;
}

/** A pseudo-random number between -0.5 and 0.5, fixed for a row. */
const scattered = (row) => (Math.imul(row + 1, 2654435761) >>> 0) / 4294967296 - 0.5;

/** Pixel of a row along an axis, NaN if undefined; codes are jittered so that they do not fall on one line. */
function placer(column, scale) {
  const values = column.values,
    log = Boolean(scale.base);
  const spread = column.labels ? 0.6 : 0;
  return (row) => {
    const value = values[row];
    if (!Number.isFinite(value) || (log && value <= 0)) return NaN;
    return scale(spread ? value + spread * scattered(row * 7 + 3) : value);
  };
}

function outside(pixel, scale) {
  const [a, b] = scale.range();
  return pixel < Math.min(a, b) - 0.5 || pixel > Math.max(a, b) + 0.5;
}

/** Draw all designs: first and pale those that are not selected, then the others, better kinds last. */
export function drawPoints(context, model, view, points, selection) {
  const there = [0, 0, 0];
  for (const kind of model.kinds) there[kind]++;
  const byFile = isByFile(model, view.colour);
  const hue = byFile ? fileColours(model) : view.colour ? rowColours(model, view, points) : null;
  const fileMark = byFile ? fileMarks(context, model) : null;
  const looks = byLook(model, points, selection.mask, Boolean(hue));
  for (const selected of [0, 1]) {
    for (const kind of [0, 1, 2]) {
      drawRows(
        context,
        points,
        looks[2 * kind + selected],
        { kind, selected, there: there[kind] },
        selected || byFile ? hue : null,
        fileMark,
      );
    }
  }
}

function drawRows(context, points, rows, { kind, selected, there }, hue, fileMark) {
  const size = kind === 2 ? ringSize(there) : dotSize(there, kind);
  context.globalAlpha = selected ? (kind === 0 ? 0.3 : 1) : kind === 0 ? 0.08 : 0.16;
  context.lineWidth = kind === 2 ? 1.5 : 1;
  context.strokeStyle = kindColour(kind);
  context.fillStyle = kind === 2 ? colours().panel : kindColour(kind);
  const square = kind === 1 && size < 1.6;
  for (const row of rows) {
    const x = points.x[row],
      y = points.y[row];
    if (hue) {
      const own = hue(row);
      if (kind === 2) context.fillStyle = own;
      else context.fillStyle = context.strokeStyle = own;
    }
    if (fileMark && kind) {
      context.fillStyle = hue(row);
      if (kind === 2) context.strokeStyle = colours().ink;
      fileMark(row, x, y, kind === 2 ? size + 1.5 : size + 0.3, kind === 2);
    } else if (square) context.fillRect(x - size, y - size, 2 * size, 2 * size);
    else mark(context, kind, x, y, size);
  }
  context.globalAlpha = 1;
}

const dotSize = (n, kind) => Math.min(3.4, Math.max(kind ? 1.2 : 1.9, 150 / Math.sqrt(n + 1)));
const ringSize = (n) => Math.min(4.2, Math.max(2.2, 60 / Math.sqrt(n + 1)));

/**
 * The rows to draw by look, twice their kind and one more where selected: of several with one look in a pixel the first,
 * which looks the same.
 * @returns {number[][]}
 */
function byLook(model, points, mask, coloured) {
  const looks = Array.from({ length: 6 }, () => []);
  const width = points.width + 2,
    taken = new Uint8Array(width * (points.height + 2));
  for (let row = 0; row < model.size; row++) {
    const x = points.x[row];
    if (Number.isNaN(x)) continue;
    const kind = model.kinds[row],
      look = 2 * kind + mask[row];
    // Crosses are larger than a pixel, so one in four pixels is as good.
    const cell = kind
      ? Math.round(points.y[row]) * width + Math.round(x)
      : Math.round(points.y[row] / 2) * width + Math.round(x / 2);
    if (!coloured && taken[cell] & (1 << look)) continue;
    taken[cell] |= 1 << look;
    looks[look].push(row);
  }
  return looks;
}

/** Colour of each row by a column; stores the ends of the scale and the number of undefined values for the legend. */
function rowColours(model, view, points) {
  const column = model.byName.get(view.colour);
  view.shades = shading(column.values, extent(column, model.kinds, { log: false, all: view.all }));
  points.missingColour = 0;
  for (let row = 0; row < model.size; row++) {
    if (!Number.isNaN(points.x[row]) && !Number.isFinite(column.values[row])) points.missingColour++;
  }
  return view.shades.of;
}
