/** The input angles of a motion, first and last, deg: a full turn, or the part of one that a mechanism moves over. */

/** Seconds of a turn, or of a way to and fro, on the screen, whatever the speed of the mechanism. */
const SECONDS = 5;

export const isTurn = ([first, last]) => last - first >= 360;

/** An input angle of a turn less whole turns, or as it is. */
export const shownAngle = (span, degrees) => (isTurn(span) ? ((degrees % 360) + 360) % 360 : degrees);

/** An input angle as text. */
export const angleText = (degrees, digits) => `${degrees.toFixed(digits).replace("-", "−")}°`;

/** The span that holds all of several motions: the turn where one of them is a turn. */
export const jointSpan = (motions) =>
  motions.map(({ span }) => span).find(isTurn) ?? [
    Math.min(...motions.map(({ span }) => span[0])),
    Math.max(...motions.map(({ span }) => span[1])),
  ];

/** Evenly spaced input angles from the first to the last. */
export const evenly = ([first, last], steps) =>
  Array.from({ length: steps + 1 }, (_, k) => first + ((last - first) * k) / steps);

/** The parts of other input angles, first and last, deg, that lie within the span; none for null. */
export const partsIn = ([first, last], over) =>
  [-720, -360, 0, 360]
    .map((turn) => (over ?? [0, 0]).map((angle) => Math.min(last, Math.max(first, angle + turn))))
    .filter(([start, stop]) => stop > start);

/**
 * The input angle after some time: a turn goes on, a part of one goes to and fro as a sine.
 * @param {{degrees: number, isBack: boolean}} state `isBack` on the way from the last angle to the first
 */
export function advance(state, span, seconds) {
  const [first, last] = span;
  if (isTurn(span)) {
    state.degrees = (state.degrees + (seconds / SECONDS) * 360) % 360;
    return;
  }
  const share = Math.min(1, Math.max(0, (state.degrees - first) / (last - first)));
  const there = Math.acos(1 - 2 * share);
  const phase = ((state.isBack ? 2 * Math.PI - there : there) + (2 * Math.PI * seconds) / SECONDS) % (2 * Math.PI);
  state.isBack = phase > Math.PI;
  state.degrees = first + (last - first) * (0.5 - 0.5 * Math.cos(phase));
}
