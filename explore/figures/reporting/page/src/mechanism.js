/**
 * The motion of a design: marks, strokes, signals and output through clutches, from the mechanism's declaration and its
 * own functions `close` and `fill`, translated from Python (see `explore.figures.reporting.javascript`).
 */

import { withSlider } from "./slider.js";
import { isTurn } from "./span.js";

const DEGREES = 180 / Math.PI;

/** The mechanism's functions; undefined on a page of a mechanism without a translation. */
const functions = () => globalThis.exploreMechanism;

/** Whether this page can compute motions. */
export const hasMotion = (declared) => Boolean(declared && functions());

/**
 * The first parameter with a value that it cannot take, which only a file that was changed has; undefined for none. The
 * mechanism's functions may loop as often as a value says.
 */
export const brokenParameter = (declared, values) =>
  declared.allowed.find(({ name, lower, upper, choices, zero }) => {
    const value = valueOf(values, name);
    const inRange = Number.isFinite(value) && value > (lower ?? -Infinity) && value <= (upper ?? Infinity);
    return !((zero && value === 0) || inRange) || (choices.length > 0 && !choices.includes(value));
  })?.name;

/** The value of a parameter; 1 where neither the study nor the declaration gives one. */
const valueOf = (values, name) => (Object.hasOwn(values, name) ? values[name] : 1);

/**
 * The motion of one design.
 * @param {Object} declared the mechanism's declaration, `study.motion`
 * @param {Object<string, number>} values parameters by name
 * @param {string} drive the drive stroke; "none" where the study uses none
 * @returns {?Object} null where the design moves neither over its whole motion nor over the interval of the study, or a
 *   parameter is broken
 */
export function motionOf(declared, values, drive) {
  if (brokenParameter(declared, values)) return null;
  let span = declared.limits ?? [0, 360],
    record = recordOf(declared, values, declared.limits);
  if (!record && declared.interval) [span, record] = [declared.interval, recordOf(declared, values, declared.interval)];
  if (!record) return null;
  const marks = Object.fromEntries(
    Object.entries(isTurn(span) ? declared.marks : {})
      .map(([name, row]) => [name, declared.anchor + 2 * DEGREES * Math.atan(record[row])])
      .filter(([, angle]) => Number.isFinite(angle)),
  );
  const motion = { declared, values, record, marks, span, out: new Float64Array(declared.signal_rows) };
  motion.speed = declared.speed ? valueOf(values, declared.speed) : 1;
  motion.phases = declared.phases_row < 0 ? 1 : Math.max(1, Math.round(record[declared.phases_row]));
  motion.drive = drive;
  motion.stroke = drive === "none" ? null : strokeOf(motion, "drive");
  motion.at = (degrees) => signals(motion, degrees);
  return withSlider(motion);
}

/** The record of a design over the full turn, or over an interval, deg; null where it has no motion there. */
function recordOf(declared, values, interval) {
  const record = new Float64Array(declared.record_rows);
  declared.parameters.forEach((name, k) => {
    record[declared.first_parameter + k] = valueOf(values, name);
  });
  if (interval) {
    record[declared.interval_row] = interval[0] / DEGREES;
    record[declared.interval_row + 1] = (interval[1] - interval[0]) / DEGREES;
  }
  functions().close(record);
  return declared.moving.includes(record[declared.status_row]) ? record : null;
}

/** First and last input angle of a stroke by its name, deg; null without strokes. */
export function strokeOf(motion, name) {
  const { declared, record, drive } = motion;
  if (Object.hasOwn(declared.strokes, name)) return after(motion, ...declared.strokes[name]);
  const strokes = Object.entries(declared.strokes);
  if (strokes.length < 2 || drive === "none") return null;
  const opposite = name === "return";
  if (Object.hasOwn(declared.strokes, drive)) {
    const other = strokes.find(([each]) => each !== drive)[1];
    return after(motion, ...(opposite ? other : declared.strokes[drive]));
  }
  const [start, stop] = strokes[0][1];
  const [first, last] = [record[declared.marks[start]], record[declared.marks[stop]]];
  const kind = (drive === "slow") !== opposite ? declared.longer : declared.shorter;
  const [from] = functions().orient(kind, first, last);
  return from === first ? after(motion, start, stop) : after(motion, stop, start);
}

/** From one mark to another, deg, the second larger; null where the design has none. */
function after({ marks }, start, stop) {
  if (!Object.hasOwn(marks, start) || !Object.hasOwn(marks, stop)) return null;
  return [marks[start], marks[start] + ((((marks[stop] - marks[start]) % 360) + 360) % 360)];
}

/** Number of the law that holds at an input angle: that of the break before it. */
function lawAt({ declared, marks }, degrees) {
  const from = (angle) => (((angle - marks[declared.breaks[0]]) % 360) + 360) % 360;
  const here = declared.breaks.length ? from(degrees) : 0;
  let law = 0;
  declared.breaks.forEach((name, k) => {
    if (k && from(marks[name]) <= here) law = k;
  });
  return law;
}

/** All signals at an input angle, in declared units, those behind clutches as of all mechanisms. */
function signals(motion, degrees) {
  const plain = plainSignals(motion, degrees);
  for (const signal of motion.declared.signals)
    if (signal.rectified) plain[signal.name] = output(motion, signal, degrees, motion.phases);
  return plain;
}

function plainSignals(motion, degrees) {
  const { declared, record, out, speed } = motion;
  // The offset from the anchor or its opposite, whichever is nearer, keeps all digits of sine and cosine; half turns are
  // taken off first, because the offset of an angle beside the opposite would be rounded.
  const halfTurns = Math.round((degrees - declared.anchor) / 180);
  const tangent = Math.tan((degrees - 180 * halfTurns - declared.anchor) / (2 * DEGREES));
  const anchor = ((halfTurns % 2) + 2) % 2;
  const variant = declared.variant_row < 0 ? 0 : record[declared.variant_row];
  const law = lawAt(motion, degrees);
  functions().fill(record, Float64Array.of(tangent), anchor, law, variant, 1, declared.needs, out);
  const values = {};
  for (const signal of declared.signals) {
    if (signal.rectified) continue;
    const value = signal.magnitude ? Math.sqrt(out[signal.row]) : out[signal.row];
    values[signal.name] = value * (signal.unit === "deg" ? DEGREES : speed ** signal.power);
  }
  return values;
}

/** A signal behind the one-way clutches of equal mechanisms, evenly phased; NaN where there is no stroke. */
export function output(motion, signal, degrees, phases) {
  if (!motion.stroke) return NaN;
  const at = (angle) => plainSignals(motion, angle)[signal.shares];
  const sense = Math.sign(at((motion.stroke[0] + motion.stroke[1]) / 2));
  let largest = 0;
  for (let k = 0; k < phases; k++) largest = Math.max(largest, sense * at(degrees + (360 * k) / phases));
  return largest;
}

/** Input angles of a motion, deg, ascending, denser near the anchor and its opposite, where it may be sharp. */
function denseAngles([first, last], anchor) {
  const angles = new Set([last]);
  for (let angle = first; angle < last; angle += 0.5) angles.add(angle);
  for (const centre of [-720, -540, -360, -180, 0, 180, 360, 540]) {
    for (let k = 0; k < 60; k++) {
      for (const sign of [-1, 1]) {
        const angle = (((anchor % 180) + 180) % 180) + centre + sign * 0.5 * 0.75 ** k;
        if (angle > first && angle < last) angles.add(angle);
      }
    }
  }
  return Float64Array.from(angles).sort();
}

/** Signals over the motion: input angles and each signal's values; angles go on past 180 degrees. */
export function overTheMotion(motion) {
  const angles = denseAngles(motion.span, motion.declared.anchor);
  const states = Array.from(angles, (angle) => motion.at(angle));
  const series = {};
  for (const { name, unit } of motion.declared.signals) {
    series[name] = Float64Array.from(states, (state) => state[name]);
    if (unit === "deg") unwrap(series[name]);
  }
  return { angles, series };
}

function unwrap(values) {
  for (let i = 1; i < values.length; i++) {
    values[i] -= 360 * Math.round((values[i] - values[i - 1]) / 360);
  }
}
