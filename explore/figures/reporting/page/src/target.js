/** The target of a study: points that a point of the linkage shall follow. */

/** Corners of the line through the points of a target; of a closed one it ends where it begins. */
export const cornersOf = ({ points, closed }) => (closed ? [...points, points[0]] : points);

/** Draw the points of a target, joined by a line. */
export function drawTarget({ context, place, colour }, target) {
  context.strokeStyle = context.fillStyle = colour.red;
  context.lineWidth = 1;
  context.globalAlpha = 0.6;
  context.setLineDash([4, 3]);
  context.beginPath();
  for (const corner of cornersOf(target)) context.lineTo(...place(corner));
  context.stroke();
  context.setLineDash([]);
  context.globalAlpha = 1;
  const radius = target.points.length <= 30 ? 3 : 1.6;
  for (const point of target.points) {
    context.beginPath();
    context.arc(...place(point), radius, 0, 2 * Math.PI);
    context.fill();
  }
  if (target.closed) return;
  context.lineWidth = 1.3;
  context.beginPath();
  context.arc(...place(target.points[0]), radius + 3, 0, 2 * Math.PI);
  context.stroke();
}
