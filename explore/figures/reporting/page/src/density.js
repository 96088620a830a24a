/** Density of all designs of the file, drawn under the designs of the page. */

import { unpack } from "./payload.js";
import { colours } from "./theme.js";

/** Read the counts of all pairs of columns. */
export async function readDensity(study) {
  if (!study.density) return;
  for (const pair of study.density.pairs) pair[2] = await unpack(pair[2]);
}

/** Draw the cells of the two columns of a view; returns the number of designs in them, 0 without counts. */
export function drawDensity(context, model, view) {
  const density = model.study.density;
  const pair = density?.pairs.find(([x, y]) => (x === view.x && y === view.y) || (x === view.y && y === view.x));
  if (!pair) return 0;
  const turned = pair[0] !== view.x,
    counts = pair[2],
    n = density.cells;
  const edges = (name, scale) => {
    const [low, high] = density.columns[name];
    const log = Boolean(scale.base);
    return Array.from({ length: n + 1 }, (_, k) => low + ((high - low) * k) / n).map((value) =>
      log && value <= 0 ? NaN : scale(value),
    );
  };
  const [x, y] = [edges(view.x, view.scaleX), edges(view.y, view.scaleY)];
  let most = 0,
    total = 0;
  for (const count of counts) {
    most = Math.max(most, count);
    total += count;
  }
  context.save();
  clip(context, view);
  context.fillStyle = colours().ink;
  for (let j = 0; j < n; j++) {
    for (let i = 0; i < n; i++) {
      const count = counts[turned ? i * n + j : j * n + i];
      if (!count || Number.isNaN(x[i]) || Number.isNaN(y[j])) continue;
      context.globalAlpha = 0.06 + (0.5 * Math.log1p(count)) / Math.log1p(most);
      context.fillRect(x[i], y[j + 1], x[i + 1] - x[i] + 0.3, y[j] - y[j + 1] + 0.3);
    }
  }
  context.restore();
  return total;
}

function clip(context, view) {
  const [left, right] = view.scaleX.range(),
    [bottom, top] = view.scaleY.range();
  context.beginPath();
  context.rect(left, top, right - left, bottom - top);
  context.clip();
}
