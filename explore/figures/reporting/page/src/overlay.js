/** Several mechanisms in one drawing, to one scale and at one input angle, each in the look of its design. */

import { bodyCurve, chain, fitView, pivotMark, poseAt, sum, trace } from "./drawing.js";
import { markAt } from "./marks.js";
import { drawTarget } from "./target.js";
import { colours } from "./theme.js";

/** Smallest and largest x and y of several drawings. */
export function jointReach(drawings) {
  const [left, right, low, high] = [0, 1, 2, 3].map((k) => drawings.map(({ reach }) => reach[k]));
  return [Math.min(...left), Math.max(...right), Math.min(...low), Math.max(...high)];
}

/**
 * Draw the mechanisms of several designs.
 * @param {CanvasRenderingContext2D} context
 * @param {Array<{drawing: Object, look: Object}>} shown drawings from `drawingOf` with the looks of their designs
 * @param {number} degrees input angle
 * @param {{width: number, height: number}} size
 */
export function drawOverlay(context, shown, degrees, size) {
  const place = fitView({ reach: jointReach(shown.map(({ drawing }) => drawing)) }, size);
  const colour = colours();
  context.clearRect(0, 0, size.width, size.height);
  context.lineJoin = "round";
  for (const { drawing, look } of shown) paths({ context, place, colour }, drawing, look);
  const targets = new Set(shown.map(({ drawing }) => drawing.target).filter(Boolean));
  for (const target of targets) drawTarget({ context, place, colour }, target);
  for (const { drawing, look } of shown) links({ context, place, colour }, drawing, look, degrees);
}

/** The paths that the links leave, of the output and of points. */
function paths(view, { drawing, turn }, { hue, dash }) {
  const { context, colour } = view;
  context.globalAlpha = 0.5;
  context.strokeStyle = colour[hue];
  context.lineWidth = 1.3;
  context.setLineDash(dash);
  for (const { point, role } of drawing.paths) if (role !== "joint") trace(view, turn[point]);
  context.setLineDash([]);
  context.globalAlpha = 1;
}

function links(view, { motion, drawing, curves }, { hue, dash, marker }, degrees) {
  const { context, place, colour } = view;
  const pose = poseAt(motion, degrees);
  const points = Object.fromEntries(Object.entries(drawing.points).map(([name, vectors]) => [name, sum(vectors, pose)]));
  for (const pivot of drawing.pivots) pivotMark({ ...view, colour: { ...colour, ink: colour[hue] } }, points[pivot]);
  context.setLineDash(dash.map((length) => 1.5 * length));
  context.lineCap = "butt";
  curves.forEach((curve, k) => bodyCurve(view, curve, drawing.profiles[k], points, pose, hue));
  for (const link of drawing.links) chain(view, link.points.map((name) => points[name]), hue, 3);
  context.setLineDash([]);
  context.lineCap = "round";
  const joints = new Set([...drawing.links.flatMap((link) => link.points), ...drawing.pivots]);
  context.fillStyle = colour[hue];
  context.strokeStyle = colour.panel;
  for (const name of joints) markAt(context, marker, ...place(points[name]), 1);
}
