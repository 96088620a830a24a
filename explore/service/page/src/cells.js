/** Cells of a density: the stronger the more designs there are, on a logarithmic scale. */

/** Opacity of a cell with one design, over that of the fullest. */
const FAINTEST = 0.18;

/**
 * @param {CanvasRenderingContext2D} context
 * @param {{scaleX: Function, scaleY: Function}} view
 * @param {{x: Object, y: Object, bins_x: number, bins_y: number}} answer where the cells are
 * @param {number[]} counts by rows of y, from low to high
 * @param {string} colour
 * @param {number} strongest opacity of the fullest cell
 */
export function drawCells(context, view, answer, counts, colour, strongest) {
  const { bins_x, bins_y } = answer;
  const edges = (side, bins, scale) =>
    Array.from({ length: bins + 1 }, (_, k) => scale(side.low + ((side.high - side.low || 1) * k) / bins));
  const x = edges(answer.x, bins_x, view.scaleX),
    y = edges(answer.y, bins_y, view.scaleY);
  const most = counts.reduce((largest, one) => Math.max(largest, one), 0);
  if (!most) return;
  const full = Math.log1p(most);
  context.save();
  context.fillStyle = colour;
  for (let j = 0; j < bins_y; j++)
    for (let i = 0; i < bins_x; i++) {
      const one = counts[j * bins_x + i];
      if (!one) continue;
      context.globalAlpha = strongest * (FAINTEST + ((1 - FAINTEST) * Math.log1p(one)) / full);
      context.fillRect(x[i], y[j + 1], x[i + 1] - x[i] + 0.4, y[j] - y[j + 1] + 0.4);
    }
  context.restore();
}
