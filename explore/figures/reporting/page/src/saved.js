/** The chosen design as files: a study of it alone, its motion, and the drawing. */

import { save } from "./csv.js";
import { parametersOf } from "./design.js";
import { el } from "./dom.js";
import { drawMechanism, drawingOf, heightOf } from "./drawing.js";
import { fileOf } from "./files.js";
import { hasMotion, motionOf } from "./mechanism.js";
import { evenly, isTurn } from "./span.js";

/** Width of the drawing, pixels, and corners of a circle. */
const WIDTH = 900,
  CORNERS = 90;
/** Rows of a motion: evenly spaced input angles of a turn from 0, or of a part of it with both ends. */
const ROWS = 360;

/**
 * @param {HTMLElement} root with the panel of the design
 * @param {import("./payload.js").Model} model
 * @param {import("./selection.js").Focus} chosen
 */
export function savedFiles(root, model, chosen) {
  const { study } = model;
  const motion = () =>
    hasMotion(study.motion) ? motionOf(study.motion, parametersOf(model, chosen.row), fileOf(model, chosen.row).drive) : null;
  const button = (text, ending, type, content) =>
    el("button", { type: "button", class: "link", onclick: () => save(`${study.name}-${model.designs[chosen.row]}.${ending}`, content(), type) }, text);
  const moving = [
    button("motion (CSV)", "csv", "text/csv", () => motionText(motion())),
    ...(study.motion?.drawing
      ? [button("drawing (SVG)", "svg", "image/svg+xml", () => drawingText(motion(), fileOf(model, chosen.row).target))]
      : []),
  ];
  const files = el("p", { class: "files small" }, "Save: ", button("study (TOML)", "toml", "application/toml", () => studyText(model, chosen.row)), ...moving.flatMap((one) => [" ", one]));
  root.querySelector(".panel-head").after(files);
  const show = () => {
    files.hidden = chosen.row < 0;
    for (const one of moving) one.hidden = chosen.row < 0 || !motion();
  };
  chosen.listen(show);
  show();
}

/** The text of a study of a design alone, in declared units. */
export function studyText(model, row) {
  const { head, points, lacks = [] } = fileOf(model, row);
  const own = model.columns.filter(({ name, role, declared }) => role === "parameter" && !lacks.includes(name) && !Number.isNaN(declared[row]));
  const values = new Map(own.map(({ name, declared }) => [name, declared[row]]));
  const isPlain = (name) => !points.some((point) => name === `${point}_along` || name === `${point}_across`);
  return [
    `# Design ${model.designs[row]} of ${model.study.name}`,
    "",
    head.trimEnd(),
    "",
    "[parameters]",
    ...[...values].filter(([name]) => isPlain(name)).map(([name, value]) => `${name} = ${value}`),
    ...points.flatMap((point) => ["", `[points.${point}]`, `along = ${values.get(`${point}_along`)}`, `across = ${values.get(`${point}_across`)}`]),
    "",
  ].join("\n");
}

/** The signals over the motion, in declared units. */
function motionText(motion) {
  const { declared } = motion;
  const heads = [`${declared.input.replaceAll(" ", "_")} [deg]`, ...declared.signals.map(({ name, unit }) => `${name} [${unit ?? ""}]`)];
  const angles = isTurn(motion.span) ? evenly(motion.span, ROWS).slice(0, -1) : evenly(motion.span, ROWS - 1);
  const lines = angles.map((degrees) => {
    const now = motion.at(degrees);
    return [degrees, ...declared.signals.map(({ name }) => now[name])].join(",");
  });
  return `${[heads.join(","), ...lines].join("\n")}\n`;
}

/** The mechanism as it is drawn first, as SVG. */
function drawingText(motion, target) {
  const drawn = drawingOf(motion, target);
  const size = { width: WIDTH, height: heightOf(drawn, WIDTH) };
  const recorded = new Recorder();
  drawMechanism(recorded, drawn, motion.stroke?.[0] ?? motion.span[0], size);
  return `<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 ${size.width} ${size.height}" width="${size.width}" height="${size.height}">\n${recorded.elements.join("\n")}\n</svg>\n`;
}

/** What the drawing uses of a canvas, recorded as elements of SVG. */
class Recorder {
  constructor() {
    Object.assign(this, { elements: [], matrix: new DOMMatrix(), kept: [], dashes: [], path: "", lineWidth: 1, globalAlpha: 1, fillStyle: "#000", strokeStyle: "#000", lineCap: "butt" });
  }
  clearRect() {}
  beginPath() {
    this.path = "";
  }
  at(letter, x, y) {
    const place = this.matrix.transformPoint({ x, y });
    this.path += `${letter}${place.x.toFixed(3)},${place.y.toFixed(3)}`;
  }
  moveTo(x, y) {
    this.at("M", x, y);
  }
  lineTo(x, y) {
    this.at(this.path ? "L" : "M", x, y);
  }
  closePath() {
    this.path += "Z";
  }
  arc(x, y, radius, from, to, isBack = false) {
    const turn = 2 * Math.PI,
      span = isBack ? -((((from - to) % turn) + turn) % turn || turn) : to - from >= turn ? turn : (((to - from) % turn) + turn) % turn;
    for (let k = 0; k <= CORNERS; k++) {
      const angle = from + (span * k) / CORNERS;
      this.lineTo(x + radius * Math.cos(angle), y + radius * Math.sin(angle));
    }
  }
  setLineDash(dashes) {
    this.dashes = dashes;
  }
  fill() {
    this.elements.push(`<path d="${this.path}" fill="${this.fillStyle}" fill-opacity="${this.globalAlpha}"/>`);
  }
  stroke() {
    const look = `stroke="${this.strokeStyle}" stroke-opacity="${this.globalAlpha}" stroke-width="${this.lineWidth}" stroke-dasharray="${this.dashes.join(" ") || "none"}"`;
    this.elements.push(`<path d="${this.path}" fill="none" ${look} stroke-linecap="${this.lineCap}" stroke-linejoin="round"/>`);
  }
  save() {
    const { matrix, dashes, lineWidth, globalAlpha, fillStyle, strokeStyle, lineCap } = this;
    this.kept.push({ matrix, dashes, lineWidth, globalAlpha, fillStyle, strokeStyle, lineCap });
  }
  restore() {
    Object.assign(this, this.kept.pop());
  }
  translate(x, y) {
    this.matrix = this.matrix.translate(x, y);
  }
  rotate(angle) {
    this.matrix = this.matrix.rotate((angle * 180) / Math.PI);
  }
  scale(x, y) {
    this.matrix = this.matrix.scale(x, y);
  }
}
