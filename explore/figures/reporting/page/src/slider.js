/** A slider that a task ties to a point of a linkage, as `explore.model.output_slider` in Python. */

import { sum } from "./drawing.js";

/** The motion with the slider that its values describe, its travel and its dwell; as it is where they describe none. */
export function withSlider(motion) {
  const { declared, values } = motion;
  const { slider, drawing } = declared;
  if (!slider || !drawing || !slider.columns.every((name) => Number.isFinite(values[name]))) return motion;
  const [x, y, guide, link, start, span] = slider.columns.map((name) => values[name]);
  const [cosine, sine] = [Math.cos((guide * Math.PI) / 180), Math.sin((guide * Math.PI) / 180)];
  const apart = (signals, input) => {
    const [px, py] = sum(drawing.points[slider.point], { ...values, ...signals, input });
    return [(px - x) * cosine + (py - y) * sine, (py - y) * cosine - (px - x) * sine];
  };
  const side = apart(motion.at(start), start)[0] > 0 ? -1 : 1;
  const at = (degrees) => {
    const signals = motion.at(degrees);
    const [along, across] = apart(signals, degrees);
    return { ...signals, [slider.signal.name]: along + side * Math.sqrt(link ** 2 - across ** 2) };
  };
  // No strokes for clutches: the slider is the output.
  return { ...motion, declared: extended(declared, x, y, guide), at, stroke: null, dwell: [start, start + span] };
}

/** The declaration with the travel as a signal and a panel, and the drawing with the slider, its guide and its link. */
function extended(declared, x, y, guide) {
  const { slider, drawing } = declared;
  const vector = (length, angle) => ({ length, angle, factor: 1, sense: 1, turn: 0 });
  const place = [vector(x, 0), vector(y, 90), vector(slider.signal.name, guide)];
  return {
    ...declared,
    signals: [...declared.signals, slider.signal],
    panels: [slider.panel, ...declared.panels],
    drawing: {
      ...drawing,
      points: { ...drawing.points, [slider.name]: place },
      links: [...drawing.links, { name: "link of the slider", points: [slider.point, slider.name] }],
      guides: [...drawing.guides, { point: slider.name, angle: guide }],
      paths: [...drawing.paths, { point: slider.name, long_name: "path of the slider", role: "output" }],
    },
  };
}
