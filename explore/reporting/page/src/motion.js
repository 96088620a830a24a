/** The motion of a four-bar over a turn of its crank: curves, drive stroke, limit positions, output through clutches. */

import { driveStroke, limitAngles, prepare, stateAt } from "./fourbar.js";

const DEGREES = 180 / Math.PI;

/** Crank angles of a turn, deg, ascending, denser near 0 and 180 where a motion may be sharp. */
export function crankAngles() {
  const angles = new Set();
  for (let k = 0; k <= 720; k++) angles.add(k / 2);
  for (const centre of [0, 180, 360]) {
    for (let k = 0; k < 60; k++) {
      const offset = 0.5 * 0.75 ** k;
      if (centre > 0) angles.add(centre - offset);
      if (centre < 360) angles.add(centre + offset);
    }
  }
  return Float64Array.from(angles).sort();
}

/**
 * The motion of one design.
 * @param {Object<string, number>} values parameters by name
 * @param {?string} drive the stroke that the clutch transmits; "none" where there is no clutch
 * @returns {?Object} null when the crank cannot turn
 */
export function fourBarMotion(values, drive) {
  const linkage = prepare(values);
  if (!linkage) return null;
  const limits = limitAngles(linkage);
  const stroke = limits && drive !== "none" ? driveStroke(linkage, limits, drive) : null;
  const phases = Math.max(1, Math.round(values.phases ?? 1));
  const motion = { linkage, limits, stroke, phases, speed: values.speed ?? 1 };
  motion.at = (degrees) => signals(motion, degrees);
  return motion;
}

/** First and last crank angle of a stroke by its name, deg; null without strokes. */
export function strokeOf({ limits, stroke }, name) {
  if (!limits) return null;
  const { overlapped, extended } = limits;
  const after = (start, stop) => [start, start + ((((stop - start) % 360) + 360) % 360)];
  if (name === "overlapped_to_extended") return after(overlapped, extended);
  if (name === "extended_to_overlapped") return after(extended, overlapped);
  return name === "drive" || !stroke ? stroke : [stroke[1], stroke[0] + 360];
}

/** All signals at a crank angle, in the units of the results. */
function signals(motion, degrees) {
  const { linkage, speed } = motion;
  const state = stateAt(linkage, degrees);
  return {
    coupler_angle: state.couplerAngle * DEGREES,
    rocker_angle: state.rockerAngle * DEGREES,
    transmission_angle: state.transmissionAngle * DEGREES,
    coupler_velocity: state.couplerVelocity * speed,
    rocker_velocity: state.rockerVelocity * speed,
    coupler_acceleration: state.couplerAcceleration * speed * speed,
    rocker_acceleration: state.rockerAcceleration * speed * speed,
    velocity_ratio: state.rockerVelocity,
    one_clutch: output(motion, degrees, 1),
    output_velocity: output(motion, degrees, motion.phases),
  };
}

/** Velocity behind the one-way clutches of equal linkages, evenly phased; NaN where there is no stroke. */
export function output(motion, degrees, phases) {
  if (!motion.stroke) return NaN;
  const middle = (motion.stroke[0] + motion.stroke[1]) / 2;
  const sense = Math.sign(stateAt(motion.linkage, middle).rockerVelocity);
  let largest = 0;
  for (let k = 0; k < phases; k++) {
    largest = Math.max(largest, sense * stateAt(motion.linkage, degrees + (360 * k) / phases).rockerVelocity);
  }
  return largest * motion.speed;
}

/** Signals over the turn: crank angles and each signal's values; angles go on past 180 degrees. */
export function overTheTurn(motion) {
  const angles = crankAngles();
  const states = Array.from(angles, (angle) => motion.at(angle));
  const series = Object.fromEntries(
    Object.keys(states[0]).map((name) => [name, Float64Array.from(states, (s) => s[name])]),
  );
  for (const name of ["coupler_angle", "rocker_angle"]) unwrap(series[name]);
  return { angles, series };
}

function unwrap(values) {
  for (let i = 1; i < values.length; i++) {
    values[i] -= 360 * Math.round((values[i] - values[i - 1]) / 360);
  }
}

/** Coordinates of crank pin and rocker joint at a crank angle, in the unit of the lengths; origin at the crank's pivot. */
export function joints(motion, degrees) {
  const { crank, rocker, ground } = motion.linkage;
  const turn = degrees / DEGREES,
    swing = stateAt(motion.linkage, degrees).rockerAngle;
  return {
    pin: [crank * Math.cos(turn), crank * Math.sin(turn)],
    joint: [ground + rocker * Math.cos(swing), rocker * Math.sin(swing)],
  };
}
