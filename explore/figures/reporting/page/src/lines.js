/** The lines of the parallel coordinates: the choice of designs, and drawing them. */

import { kindColour, opacity } from "./marks.js";
import { colours } from "./theme.js";

/** Largest number of lines of each kind, of those that are not selected, and the share of both while a brush moves. */
const MAX_LINES = [400, 1200, 3000],
  MOST_OTHERS = 400;
export const QUICK = 0.2;

/** Rows in a pseudo-random order, the same each time, Pareto-optimal designs first. */
export function shuffledRows(model) {
  const key = (row) => Math.imul(row + 1, 2654435761) >>> 0;
  return Uint32Array.from({ length: model.size }, (_, row) => row).sort(
    (a, b) => model.kinds[b] - model.kinds[a] || key(a) - key(b),
  );
}

/** Choose the designs to draw: selected ones and some of the others, at most `share` of the largest numbers. */
export function chooseLines(model, order, { mask }, share) {
  const selected = [],
    others = [],
    left = MAX_LINES.map((most) => most * share);
  for (const row of order) {
    const kind = model.kinds[row];
    if (mask[row]) {
      if (left[kind]-- > 0) selected.push(row);
    } else if (others.length < MOST_OTHERS * share && kind > 0) others.push(row);
  }
  return { selected, others };
}

/**
 * Draw lines, the better kinds over the others.
 * @param {CanvasRenderingContext2D} context
 * @param {(row: number) => void} trace adds a design's line to the path
 * @param {?(row: number) => string} hue colour of a feasible design; null for that of its kind
 */
export function drawLines(context, kinds, { selected, others }, trace, hue) {
  const stroke = (row) => {
    context.beginPath();
    trace(row);
    context.stroke();
  };
  context.lineWidth = 1;
  context.globalAlpha = opacity(0, others.length);
  context.strokeStyle = colours().muted;
  for (const row of others) stroke(row);
  for (const kind of [0, 1, 2]) {
    const rows = selected.filter((row) => kinds[row] === kind);
    context.strokeStyle = kindColour(kind);
    context.lineWidth = kind === 2 ? 1.3 : 1;
    context.setLineDash(kind === 0 ? [3, 3] : []);
    context.globalAlpha = opacity(kind, rows.length);
    for (const row of rows) {
      if (hue && kind > 0) context.strokeStyle = hue(row);
      stroke(row);
    }
  }
  context.globalAlpha = 1;
}
