/**
 * The four-bar linkage in closed form without cancellation, as `explore.mechanisms.four_bar` has it; see there and
 * docs/physics.md for the formulas. Angles in rad, velocities and accelerations for unit crank velocity.
 */

/** Sum of four numbers with the rounding errors carried along (Ogita, Rump & Oishi 2005). */
export function exactSum(a, b, c, d) {
  let total = a,
    carried = 0;
  for (const term of [b, c, d]) {
    const next = total + term;
    const shadow = next - total;
    carried += total - (next - shadow) + (term - shadow);
    total = next;
  }
  return total + carried;
}

/**
 * What the motion of a linkage is computed from; null when its crank cannot turn.
 * @param {{crank: number, coupler: number, rocker: number, ground: number, branch?: number}} lengths
 */
export function prepare({ crank, coupler, rocker, ground, branch = 1 }) {
  const e1 = exactSum(ground, -crank, -coupler, rocker),
    e2 = exactSum(ground, -crank, coupler, -rocker);
  const e3 = exactSum(coupler, rocker, -ground, -crank),
    e4 = exactSum(crank, coupler, rocker, ground);
  // Near the change point a decimal sum misses exact zero by a few units in the last place.
  const least = 4 * 2 ** -52 * Math.max(crank, coupler, rocker, ground);
  if (!(e1 * e2 > 0 && e3 * e4 > 0) || Math.min(Math.abs(e1), Math.abs(e2), Math.abs(e3)) <= least) return null;
  return { crank, coupler, rocker, ground, branch, p0: e1 * e2, q0: e3 * e4, product: crank * ground };
}

/**
 * Sine and cosine of half a crank angle in degrees, each accurate relative to its own size.
 * @returns {[number, number]}
 */
export function half(degrees) {
  const quarter = Math.round(degrees / 180);
  const offset = ((degrees - 180 * quarter) * Math.PI) / 360;
  const sine = Math.sin(offset),
    cosine = Math.cos(offset);
  return [
    [sine, cosine],
    [cosine, -sine],
    [-sine, -cosine],
    [-cosine, sine],
  ][((quarter % 4) + 4) % 4];
}

/** Position, velocities and accelerations at a crank angle in degrees. */
export function stateAt(linkage, degrees) {
  const { crank, coupler, rocker, ground, branch, p0, q0, product } = linkage;
  const [sine, cosine] = half(degrees);
  const s2 = sine * sine,
    c2 = cosine * cosine;
  const p = p0 + 4 * product * s2,
    q = q0 + 4 * product * c2;
  const d2 = (ground - crank) ** 2 + 4 * product * s2;
  const across = branch * Math.sqrt(p * q),
    x = across / 2;
  const excess = coupler - rocker;
  const dx = ground - crank + 2 * crank * s2,
    dy = -2 * crank * sine * cosine;
  const couplerAlong = 2 * coupler * excess + p,
    rockerAlong = 2 * rocker * excess - p;
  const productSine = 2 * product * sine * cosine;
  const f = productSine / x;
  const k = couplerAlong / (2 * d2),
    kLessOne = rockerAlong / (2 * d2);
  const g = (crank * (ground - crank) - 2 * product * s2) / d2;
  const dLog = (2 * productSine) / d2;
  const fRate = (product * (c2 - s2) - 0.25 * f * f * (q - p)) / x;
  const common = dLog * (0.5 + g - (excess * (coupler + rocker) * f) / (2 * d2));
  return {
    couplerAngle: Math.atan2(couplerAlong * dy + across * dx, couplerAlong * dx - across * dy),
    rockerAngle: Math.atan2(rockerAlong * dy + across * dx, rockerAlong * dx - across * dy),
    transmissionAngle: 2 * Math.atan2(Math.sqrt(p), Math.sqrt(q)),
    couplerVelocity: kLessOne * f - g,
    rockerVelocity: k * f - g,
    couplerAcceleration: kLessOne * fRate + common,
    rockerAcceleration: k * fRate + common,
  };
}

/**
 * Crank angles of the limit positions, deg: overlapped (coupler over crank) and extended (in line with it); null when
 * the output turns fully.
 */
export function limitAngles({ crank, coupler, rocker, ground, branch }) {
  if (crank > Math.min(coupler, rocker, ground)) return null;
  const lessCrank = exactSum(coupler, rocker, ground, -crank),
    lessCoupler = exactSum(rocker, ground, crank, -coupler);
  const lessRocker = exactSum(crank, coupler, ground, -rocker),
    lessGround = exactSum(crank, coupler, rocker, -ground);
  const e1 = exactSum(ground, -crank, -coupler, rocker),
    e2 = exactSum(ground, -crank, coupler, -rocker);
  const e3 = exactSum(coupler, rocker, -ground, -crank),
    total = exactSum(crank, coupler, rocker, ground);
  const extended = Math.sqrt((e1 * lessGround) / (total * lessRocker));
  const overlapped = Math.sqrt((lessCoupler * e3) / (lessCrank * e2));
  const degrees = (tangent) => (360 / Math.PI) * Math.atan(tangent);
  return { overlapped: branch * (degrees(overlapped) - 180), extended: branch * degrees(extended) };
}

/**
 * Crank angles between which the clutch transmits, deg, the second larger.
 * @param {string} drive slow, fast, overlapped_to_extended or extended_to_overlapped
 */
export function driveStroke(linkage, limits, drive) {
  const { crank, coupler, rocker, ground, branch } = linkage;
  const order = (coupler - ground) * (coupler + ground) + (rocker - crank) * (rocker + crank);
  const tie = 4 * 2 ** (Math.floor(Math.log2(Math.max(coupler, rocker, ground) ** 2)) - 52);
  const slowPassesZero = order < -tie;
  const forward = branch > 0;
  const named = { overlapped_to_extended: forward, extended_to_overlapped: !forward };
  const throughZero = named[drive] ?? slowPassesZero === (drive !== "fast");
  const [first, last] = [limits.overlapped * branch, limits.extended * branch];
  const [start, stop] = throughZero ? [first, last] : [last, first + 360];
  const turn = throughZero ? 0 : 360;
  return forward ? [start, stop] : [turn - stop, turn - start];
}
