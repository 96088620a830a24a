/** The linkage in true proportions: links, pivots, paths of its joints, limit positions, drive stroke. */

import { joints } from "./motion.js";
import { colours } from "./theme.js";

const STEPS = 360;

/**
 * Draw a four-bar.
 * @param {CanvasRenderingContext2D} context
 * @param {Object} motion from `fourBarMotion`
 * @param {number} degrees crank angle
 * @param {{width: number, height: number}} size
 */
export function drawLinkage(context, motion, degrees, size) {
  const colour = colours();
  const place = fitView(motion, size);
  context.clearRect(0, 0, size.width, size.height);
  context.lineCap = context.lineJoin = "round";
  paths(context, motion, place, colour);
  if (motion.stroke) driveStrokeArc(context, motion, place, colour);
  if (motion.limits) limitPositions(context, motion, place, colour);
  const ground = [motion.linkage.ground, 0];
  const { pin, joint } = joints(motion, degrees);
  chain(context, [[0, 0], pin], place, colour.green, 5);
  chain(context, [pin, joint], place, colour.orange, 5);
  chain(context, [joint, ground], place, colour.blue, 5);
  for (const pivot of [[0, 0], ground]) pivotMark(context, place(pivot), colour);
  for (const point of [[0, 0], pin, joint, ground]) jointMark(context, place(point), colour);
}

/** Pixels between the linkage and the border. */
const MARGIN = 30;
const LEAST_HEIGHT = 190,
  MOST_HEIGHT = 330;

/** Height of a drawing of this width. */
export function heightOf(motion, width) {
  const [left, right, low, high] = reach(motion);
  const needed = ((width - 2 * MARGIN) * (high - low)) / (right - left) + 2 * MARGIN;
  return Math.round(Math.min(MOST_HEIGHT, Math.max(LEAST_HEIGHT, needed)));
}

/** Smallest and largest x and y of all joints over a turn. */
function reach(motion) {
  const { crank, ground } = motion.linkage;
  let [left, right, low, high] = [-crank, Math.max(crank, ground), -crank, crank];
  for (let k = 0; k < STEPS; k += 4) {
    const [x, y] = joints(motion, k).joint;
    [left, right, low, high] = [Math.min(left, x), Math.max(right, x), Math.min(low, y), Math.max(high, y)];
  }
  return [left, right, low, high];
}

/** Scale both axes equally so that the whole motion fits into the canvas. */
function fitView(motion, { width, height }) {
  const [left, right, low, high] = reach(motion);
  const scale = Math.min((width - 2 * MARGIN) / (right - left), (height - 2 * MARGIN) / (high - low));
  const [x0, y0] = [(width - scale * (left + right)) / 2, (height + scale * (low + high)) / 2];
  return ([x, y]) => [x0 + scale * x, y0 - scale * y];
}

function trace(context, points, place) {
  context.beginPath();
  for (const point of points) context.lineTo(...place(point));
}

function paths(context, motion, place, colour) {
  const turn = Array.from({ length: STEPS + 1 }, (_, k) => joints(motion, k));
  context.lineWidth = 1;
  context.strokeStyle = colour.line;
  trace(
    context,
    turn.map(({ pin }) => pin),
    place,
  );
  context.stroke();
  context.lineWidth = 4;
  trace(
    context,
    turn.map(({ joint }) => joint),
    place,
  );
  context.stroke();
  context.lineWidth = 1.3;
  context.strokeStyle = colour.purple;
  context.setLineDash([6, 3, 1.5, 3]);
  trace(
    context,
    turn.map(({ pin, joint }) => [(pin[0] + joint[0]) / 2, (pin[1] + joint[1]) / 2]),
    place,
  );
  context.stroke();
  context.setLineDash([]);
}

/** Draw the drive stroke on the crank's circle, with the sense of rotation. */
function driveStrokeArc(context, motion, place, colour) {
  const [start, stop] = motion.stroke;
  const at = (share) => joints(motion, start + share * (stop - start)).pin;
  context.strokeStyle = context.fillStyle = colour.green;
  context.globalAlpha = 0.55;
  context.lineWidth = 3;
  context.lineCap = "butt";
  trace(
    context,
    Array.from({ length: 121 }, (_, k) => at(k / 120)),
    place,
  );
  context.stroke();
  context.globalAlpha = 1;
  const [x, y] = place(at(0.5)),
    [bx, by] = place(at(0.49));
  const angle = Math.atan2(y - by, x - bx);
  context.save();
  context.translate(x, y);
  context.rotate(angle);
  context.beginPath();
  context.moveTo(7, 0);
  context.lineTo(-4, -5);
  context.lineTo(-4, 5);
  context.closePath();
  context.fill();
  context.restore();
  context.lineCap = "round";
}

function limitPositions(context, motion, place, colour) {
  const dashes = { overlapped: [2, 4], extended: [7, 4] };
  for (const [name, angle] of Object.entries(motion.limits)) {
    const { pin, joint } = joints(motion, angle);
    context.setLineDash(dashes[name]);
    context.globalAlpha = 0.75;
    chain(context, [[0, 0], pin, joint, [motion.linkage.ground, 0]], place, colour.muted, 1.4);
    context.globalAlpha = 1;
  }
  context.setLineDash([]);
}

function chain(context, points, place, colour, width) {
  context.strokeStyle = colour;
  context.lineWidth = width;
  trace(context, points, place);
  context.stroke();
}

function jointMark(context, [x, y], colour) {
  context.beginPath();
  context.arc(x, y, 4.5, 0, 2 * Math.PI);
  context.fillStyle = colour.panel;
  context.strokeStyle = colour.ink;
  context.lineWidth = 1.8;
  context.fill();
  context.stroke();
}

/** A pivot on the ground: a triangle on a hatched line. */
function pivotMark(context, [x, y], colour) {
  context.strokeStyle = colour.ink;
  context.fillStyle = colour.panel;
  context.lineWidth = 1.3;
  context.beginPath();
  context.moveTo(x, y);
  context.lineTo(x - 8, y + 13);
  context.lineTo(x + 8, y + 13);
  context.closePath();
  context.fill();
  context.stroke();
  context.beginPath();
  context.moveTo(x - 13, y + 13);
  context.lineTo(x + 13, y + 13);
  for (let k = -12; k <= 12; k += 5) {
    context.moveTo(x + k, y + 13);
    context.lineTo(x + k - 4, y + 18);
  }
  context.stroke();
}
