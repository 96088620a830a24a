/** A mechanism in true proportions, from its declared drawing: links, guides, pivots, paths, curves, drive stroke. */

import { evenly, isTurn } from "./span.js";
import { drawTarget } from "./target.js";
import { colours } from "./theme.js";

const STEPS = 360;
/** Colours of the links and of the curves of bodies, in turn. */
export const HUES = ["green", "orange", "blue", "purple", "sky"];

/** Pixels between the mechanism and the border. */
const MARGIN = 30;
const LEAST_HEIGHT = 190,
  MOST_HEIGHT = 330;

/** The values that vectors name, at an input angle: parameters and signals. */
export const poseAt = (motion, degrees) => ({ ...motion.values, ...motion.at(degrees), input: degrees });

/** The sum of vectors, [x, y]. */
export function sum(vectors, pose) {
  const named = (value) => (typeof value === "string" ? pose[value] : value);
  let [x, y] = [0, 0];
  for (const { length, angle, factor, sense, turn } of vectors) {
    const direction = ((sense * named(angle) + turn) * Math.PI) / 180;
    x += factor * named(length) * Math.cos(direction);
    y += factor * named(length) * Math.sin(direction);
  }
  return [x, y];
}

/** The declared drawing at the place of a design in its plane, as `Drawing.placed` in Python. */
function placed({ drawing, place }, values) {
  const [x, y, degrees] = place.map((name) => values[name] ?? 0);
  if (!x && !y && !degrees) return drawing;
  const at = (length, angle) => ({ length, angle, factor: 1, sense: 1, turn: 0 });
  const turned = (vectors) => vectors.map((vector) => ({ ...vector, turn: vector.turn + degrees }));
  const points = Object.entries(drawing.points).map(([name, vectors]) => [name, [at(x, 0), at(y, 90), ...turned(vectors)]]);
  return {
    ...drawing,
    points: Object.fromEntries(points),
    guides: drawing.guides.map((guide) => ({ ...guide, angle: guide.angle + degrees })),
    profiles: drawing.profiles.map((profile) => ({ ...profile, vectors: turned(profile.vectors) })),
  };
}

/**
 * A drawing of a motion: its paths are computed once.
 * @param {Object} motion from `motionOf`
 * @param {?Object} target the study's, null for none
 */
export function drawingOf(motion, target) {
  const plain = placed(motion.declared, motion.values);
  const poses = evenly(motion.span, STEPS).map((degrees) => poseAt(motion, degrees));
  const turn = Object.fromEntries(
    Object.entries(plain.points).map(([name, vectors]) => [name, poses.map((pose) => sum(vectors, pose))]),
  );
  const guides = plain.guides.map((guide) =>
    guide.follows_path ? { ...guide, angle: directionOf(turn[guide.point]) } : guide,
  );
  const drawing = { ...plain, guides };
  const curves = drawing.profiles.map((profile) => poses.map((pose) => sum(profile.vectors, pose)));
  const drawn = { motion, drawing, turn, curves, target };
  drawn.reach = reach(drawn);
  return drawn;
}

/** Direction of a straight path, deg: from its first place to the farthest. */
function directionOf([[x0, y0], ...rest]) {
  const ways = rest.map(([x, y]) => [x - x0, y - y0]);
  const [x, y] = ways.reduce((far, way) => (Math.hypot(...way) > Math.hypot(...far) ? way : far), [0, 0]);
  return (Math.atan2(y, x) * 180) / Math.PI;
}

/** Smallest and largest x and y over the motion. */
function reach({ drawing, turn, curves, target }) {
  const all = [...Object.values(turn).flat(), ...(target?.points ?? [])];
  drawing.profiles.forEach(({ centre }, k) => {
    const radius = curves[k].reduce((most, [x, y]) => Math.max(most, Math.hypot(x, y)), 0);
    const [x, y] = turn[centre][0];
    all.push([x - radius, y - radius], [x + radius, y + radius]);
  });
  return all.reduce(
    ([left, right, low, high], [x, y]) => [Math.min(left, x), Math.max(right, x), Math.min(low, y), Math.max(high, y)],
    [Infinity, -Infinity, Infinity, -Infinity],
  );
}

/** Height of a drawing of this width. */
export function heightOf({ reach: [left, right, low, high] }, width) {
  const needed = ((width - 2 * MARGIN) * (high - low)) / (right - left) + 2 * MARGIN;
  return Math.round(Math.min(MOST_HEIGHT, Math.max(LEAST_HEIGHT, needed)));
}

/** Scale both axes equally so that the whole motion fits into the canvas. */
export function fitView({ reach: [left, right, low, high] }, { width, height }) {
  const scale = Math.min((width - 2 * MARGIN) / (right - left), (height - 2 * MARGIN) / (high - low));
  const [x0, y0] = [(width - scale * (left + right)) / 2, (height + scale * (low + high)) / 2];
  return ([x, y]) => [x0 + scale * x, y0 - scale * y];
}

/**
 * Draw a mechanism.
 * @param {CanvasRenderingContext2D} context
 * @param {Object} drawn from `drawingOf`
 * @param {number} degrees input angle
 * @param {{width: number, height: number}} size
 */
export function drawMechanism(context, drawn, degrees, size) {
  const { motion, drawing, turn } = drawn;
  const view = { context, place: fitView(drawn, size), colour: colours() };
  context.clearRect(0, 0, size.width, size.height);
  context.lineCap = context.lineJoin = "round";
  for (const { point, role } of drawing.paths) if (role !== "point") pathOf(view, turn[point], role);
  for (const { point, dashes } of pointPaths(drawing)) pathOf(view, turn[point], "point", dashes);
  if (drawn.target) drawTarget(view, drawn.target);
  if (motion.stroke && drawing.stroke_point) strokeArc(view, motion, motion.stroke, drawing.points[drawing.stroke_point]);
  if (motion.dwell) strokeArc(view, motion, motion.dwell, drawing.points[motion.declared.slider.point]);
  limitPositions(view, motion, drawing);
  const pose = poseAt(motion, degrees);
  const points = Object.fromEntries(Object.entries(drawing.points).map(([name, vectors]) => [name, sum(vectors, pose)]));
  for (const guide of drawing.guides) guideMark(view, turn[guide.point], guide.angle);
  drawn.curves.forEach((curve, k) => bodyCurve(view, curve, drawing.profiles[k], points, pose, HUES[k]));
  drawing.links.forEach((link, k) => chain(view, link.points.map((name) => points[name]), HUES[k % HUES.length], 5));
  for (const { point, angle } of drawing.guides) sliderMark(view, points[point], angle);
  for (const pivot of drawing.pivots) pivotMark(view, points[pivot]);
  const joints = new Set([...drawing.links.flatMap((link) => link.points), ...drawing.pivots]);
  for (const name of joints) jointMark(view, points[name]);
}

export function trace({ context, place }, points) {
  context.beginPath();
  for (const point of points) context.lineTo(...place(point));
  context.stroke();
}

/** Dashes of the paths of points, in turn, as in figures: a groove and up to four points. */
const POINT_DASHES = [
  [6, 3, 1.5, 3],
  [0.5, 3],
  [8, 4],
  [3, 3],
  [9, 3, 0.5, 3, 0.5, 3],
];

/** The paths of points, each with its dashes. */
export const pointPaths = ({ paths }) =>
  paths
    .filter(({ role }) => role === "point")
    .map((path, k) => ({ ...path, dashes: POINT_DASHES[k % POINT_DASHES.length] }));

function pathOf(view, points, role, dashes = []) {
  const { context, colour } = view;
  context.lineWidth = { joint: 1, output: 4, point: 1.3 }[role];
  context.strokeStyle = role === "point" ? colour.purple : colour.line;
  context.setLineDash(dashes);
  trace(view, points);
  context.setLineDash([]);
}

/** Draw the drive stroke or the dwell on the path of its point, with the sense of rotation. */
function strokeArc(view, motion, [start, stop], vectors) {
  const { context, place, colour } = view;
  const at = (share) => sum(vectors, poseAt(motion, start + share * (stop - start)));
  context.strokeStyle = context.fillStyle = colour.green;
  context.globalAlpha = 0.55;
  context.lineWidth = 3;
  context.lineCap = "butt";
  trace(view, Array.from({ length: 121 }, (_, k) => at(k / 120)));
  context.globalAlpha = 1;
  const [x, y] = place(at(0.5)),
    [bx, by] = place(at(0.49));
  context.save();
  context.translate(x, y);
  context.rotate(Math.atan2(y - by, x - bx));
  context.beginPath();
  context.moveTo(7, 0);
  context.lineTo(-4, -5);
  context.lineTo(-4, 5);
  context.closePath();
  context.fill();
  context.restore();
  context.lineCap = "round";
}

/** Dashes of the limit positions, in turn. */
export const DASHES = [
  [2, 4],
  [7, 4],
];

/** Limit positions: name and input angle of each. */
export const limitsOf = ({ declared, marks, span }) =>
  isTurn(span)
    ? Object.entries(marks).filter(([name]) => declared.ends.includes(name))
    : [["first", span[0]], ["last", span[1]]];

function limitPositions(view, motion, drawing) {
  const { context } = view;
  limitsOf(motion).forEach(([, angle], k) => {
    const pose = poseAt(motion, angle);
    context.setLineDash(DASHES[k % DASHES.length]);
    context.globalAlpha = 0.75;
    for (const { points } of drawing.links) chain(view, points.map((name) => sum(drawing.points[name], pose)), "muted", 1.4);
    context.globalAlpha = 1;
  });
  context.setLineDash([]);
}

export function chain(view, points, hue, width) {
  view.context.strokeStyle = view.colour[hue];
  view.context.lineWidth = width;
  trace(view, points);
}

/** The curve of a body, turned about its centre. */
export function bodyCurve(view, curve, { centre, angle, sense }, points, pose, hue) {
  const turn = (sense * pose[angle] * Math.PI) / 180;
  const [cosine, sine] = [Math.cos(turn), Math.sin(turn)];
  const [x0, y0] = points[centre];
  chain(view, curve.map(([x, y]) => [x0 + x * cosine - y * sine, y0 + x * sine + y * cosine]), hue, 2);
  // A spoke shows how far the body has turned.
  const [x, y] = curve[0];
  chain(view, [points[centre], [x0 + x * cosine - y * sine, y0 + x * sine + y * cosine]], hue, 1);
}

/** A guide along the path of its point, a little longer, as a pair of lines. */
function guideMark(view, path, degrees) {
  const [cosine, sine] = [Math.cos((degrees * Math.PI) / 180), Math.sin((degrees * Math.PI) / 180)];
  const places = path.map(([x, y]) => x * cosine + y * sine);
  const ends = [path[places.indexOf(Math.min(...places))], path[places.indexOf(Math.max(...places))]].map(view.place);
  view.context.strokeStyle = view.colour.ink;
  view.context.lineWidth = 1.3;
  for (const side of [-9, 9]) {
    view.context.beginPath();
    const beyond = [-14, 14];
    ends.forEach(([x, y], k) =>
      view.context.lineTo(x + beyond[k] * cosine - side * sine, y - beyond[k] * sine - side * cosine),
    );
    view.context.stroke();
  }
}

/** A slider: a block in its guide. */
function sliderMark({ context, place, colour }, point, degrees) {
  context.save();
  context.translate(...place(point));
  context.rotate((-degrees * Math.PI) / 180);
  context.beginPath();
  for (const [x, y] of [[-13, -8], [13, -8], [13, 8], [-13, 8]]) context.lineTo(x, y);
  context.closePath();
  context.fillStyle = colour.panel;
  context.strokeStyle = colour.ink;
  context.lineWidth = 1.5;
  context.fill();
  context.stroke();
  context.restore();
}

function jointMark({ context, place, colour }, point) {
  context.beginPath();
  context.arc(...place(point), 4.5, 0, 2 * Math.PI);
  context.fillStyle = colour.panel;
  context.strokeStyle = colour.ink;
  context.lineWidth = 1.8;
  context.fill();
  context.stroke();
}

/** A pivot on the ground: a triangle on a hatched line. */
export function pivotMark({ context, place, colour }, point) {
  const [x, y] = place(point);
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
