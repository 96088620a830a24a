/** How far the path of a design is from the target of the study, over the input angle. */

import { poseAt, sum } from "./drawing.js";
import { isTurn, shownAngle } from "./span.js";
import { cornersOf } from "./target.js";

/** Most given points whose places on the path are looked for. */
const MOST_SOUGHT = 200;
/** Halvings of the part of the turn about such a place. */
const HALVINGS = 40;
/** Largest distance that the chart shows, over the largest at a given point, for targets that do not close. */
const BEYOND = 3;
/** Largest distance at the given points, over the largest of all, with which the points count as met exactly. */
const MET = 1e-6;

/**
 * The panel of the distance of the path from the target; null without a target.
 * @param {{motion: Object, turn: {angles: Float64Array}, drawing: ?Object}} one a design, its drawing from `drawingOf`
 */
export function targetPanel({ motion, turn, drawing }) {
  const target = drawing?.target;
  if (!target) return null;
  const { factor, unit } = target,
    corners = cornersOf(target),
    vectors = drawing.drawing.points[target.point];
  const placeAt = (degrees) => sum(vectors, poseAt(motion, degrees));
  const at = (degrees) => factor * distanceToLine(placeAt(degrees), corners);
  const nearest = nearestPlaces(target, drawing.turn[target.point], motion.span, placeAt);
  const marks = nearest.map(([angle, far]) => [angle, factor * far]);
  const farthest = marks.reduce((most, [, far]) => Math.max(most, far), 0);
  const { angles } = turn;
  const values = Float64Array.from(angles, at);
  const isMet = farthest <= MET * values.reduce((most, far) => Math.max(most, far), 0);
  const trace = { name: "", hue: "purple", label: "", dash: [], marker: "", isPart: false, motion, angles, at };
  return {
    title: "distance to target",
    unit,
    factor,
    fullTurn: 0,
    fromZero: true,
    motion: { ...motion, stroke: null, marks: {} },
    most: target.closed || isMet ? Infinity : BEYOND * farthest,
    marks,
    traces: [{ ...trace, values }],
  };
}

/** Distance of a place from the line through corners. */
function distanceToLine([x, y], corners) {
  let least = Infinity;
  for (let k = 0; k < Math.max(1, corners.length - 1); k++) {
    const [x0, y0] = corners[k],
      [x1, y1] = corners[k + 1] ?? corners[k];
    const [dx, dy] = [x1 - x0, y1 - y0];
    const square = dx * dx + dy * dy;
    const share = square ? Math.min(1, Math.max(0, ((x - x0) * dx + (y - y0) * dy) / square)) : 0;
    least = Math.min(least, Math.hypot(x - x0 - share * dx, y - y0 - share * dy));
  }
  return least;
}

/**
 * Of each given point the input angle, deg, at which the path is nearest, and the distance there; none of many points,
 * and of points at given crank angles.
 */
function nearestPlaces({ points, timed }, path, span, placeAt) {
  if (timed || points.length > MOST_SOUGHT) return [];
  return points.map(([x, y]) => {
    const far = ([px, py]) => Math.hypot(px - x, py - y);
    const distances = path.map(far);
    const nearest = distances.reduce((best, one, k) => (one < distances[best] ? k : best), 0);
    const [first, last] = span,
      step = (last - first) / (path.length - 1);
    let [low, high] = [nearest - 1, nearest + 1].map((k) => first + k * step);
    // A part of a turn ends at its ends.
    if (!isTurn(span)) [low, high] = [Math.max(low, first), Math.min(high, last)];
    for (let k = 0; k < HALVINGS; k++) {
      const [a, b] = [low + (high - low) / 3, high - (high - low) / 3];
      if (far(placeAt(a)) < far(placeAt(b))) high = b;
      else low = a;
    }
    const angle = (low + high) / 2;
    return [shownAngle(span, angle), far(placeAt(angle))];
  });
}
