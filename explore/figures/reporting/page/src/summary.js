/** Facts of the study: name and counts, statuses of the designs, constraints, provenance. */

import { el } from "./dom.js";
import { count, countOf, number, words } from "./format.js";
import { isDark, toggle } from "./theme.js";

/** The head of the page. */
export function header(root, { study }) {
  const button = el("button", {
    type: "button",
    class: "theme",
    onclick: () => {
      toggle();
      label();
    },
  });
  const label = () => {
    button.textContent = isDark() ? "Light" : "Dark";
  };
  label();
  const front = study.parts[2].total;
  const figures = [
    [count(study.studied), "designs"],
    ...(study.feasible === null
      ? []
      : [
          [count(study.feasible), "feasible"],
          [count(front), "Pareto-optimal"],
        ]),
  ];
  root.append(
    el(
      "div",
      { class: "names" },
      el("h1", {}, study.name),
      el("p", {}, el("strong", {}, study.mechanism), study.summary ? ` — ${study.summary}` : ""),
    ),
    el(
      "div",
      { class: "figures" },
      ...figures.map(([value, name]) => el("div", {}, el("strong", {}, value), el("span", {}, name))),
    ),
    button,
  );
}

/** Notices about designs that the page does not hold. */
export function notices(root, { study, size }) {
  for (const caveat of study.caveats ?? []) root.append(el("p", { class: "notice" }, `${caveat}.`));
  for (const file of study.files ?? [study]) fileNotices(root, file, study.files ? held(file) : size);
}

const held = ({ parts }) => parts.reduce((total, part_) => total + part_.held, 0);

/** Notices about one file; of several, each begins with its name. */
function fileNotices(root, study, size) {
  const notice = (...sentences) =>
    root.append(el("p", { class: "notice" }, [study.lacks ? `${study.name}:` : "", ...sentences].filter(Boolean).join(" ")));
  if (!study.complete) {
    notice(
      `This sweep is not finished: ${count(study.committed)} of ${count(study.studied)} designs are computed.`,
      "Run the same sweep again to continue, then the report.",
    );
  }
  if (study.keep !== "all") {
    notice(
      `Only the Pareto set was kept of this study: ${countOf(study.committed, "design")} of ${count(study.studied)}.`,
      "The others were only counted; sweep with --keep all to keep them.",
    );
  }
  if (study.parts.some(({ held, total }) => held < total)) {
    const [infeasible, feasible, front] = study.parts;
    const nearest = study.nearest ? " and those nearest to feasible" : "";
    const kinds = [
      [front, "Pareto-optimal ones"],
      [feasible, "other feasible ones"],
      [infeasible, `infeasible ones${nearest}`],
    ].filter(([{ total }]) => total > 0);
    notice(
      `This page holds ${count(size)} of ${count(study.committed)} designs:`,
      `${kinds.map(([kind, what]) => part(kind, what)).join("; ")}. Selections and their counts refer to these designs;`,
      "the command ranks all designs of the file.",
      study.density && "The grey density behind the scatter counts all feasible designs.",
    );
  }
}

/** Text for the number of designs of a kind on the page. */
const part = ({ held, total }, what) =>
  held === total
    ? `all ${count(total)} ${what}`
    : `a uniform sample of ${count(held)} of ${count(total)} ${what}`;

/**
 * Statuses, constraints and provenance.
 * @param {Element} root
 * @param {import("./payload.js").Model} model
 * @param {(design: number) => void} choose called where the number of a design is clicked
 */
export function facts(root, { study }, choose) {
  root.append(el("div", { class: "panel-head" }, el("h2", {}, study.files ? "The studies" : "The study")));
  for (const file of study.files ?? [study]) {
    // Of several files the objectives are those of the joint Pareto set.
    const shown = { ...study, ...file, objectives: study.objectives };
    root.append(
      study.files ? el("h3", { class: "file" }, file.name) : "",
      el("div", { class: "facts" }, statuses(shown), constraints(shown, choose), provenance(shown)),
      file.config ? el("details", {}, el("summary", {}, "The study file"), el("pre", {}, file.config)) : "",
    );
  }
}

function statuses(study) {
  const all = study.counts.reduce((total, [, number_]) => total + number_, 0) || 1;
  const rows = study.counts.map(([label, designs, sentence]) => {
    const bar = el("i", {});
    bar.style.width = `${(100 * designs) / all}%`;
    return el(
      "tr",
      {},
      el("th", {}, words(label)),
      el("td", { class: "share" }, el("span", {}, designs ? bar : "")),
      el("td", { class: "count" }, count(designs)),
      el("td", {}, sentence),
    );
  });
  return el("div", {}, el("h3", {}, "Status of the designs"), el("table", {}, ...rows));
}

function constraints(study, choose) {
  const rows = study.missed.map(([metric, low, high, unit, missed, unknown]) => {
    const bound =
      low === null ? `≤ ${number(high)}` : high === null ? `≥ ${number(low)}` : `${number(low)} … ${number(high)}`;
    const counts = [missed === null ? "" : `missed by ${count(missed)}`, unknown ? `undefined in ${count(unknown)}` : ""];
    if (study.nearest) counts.push(...relaxations(study.nearest, metric, unit));
    return el(
      "tr",
      {},
      el("th", {}, words(metric)),
      el("td", { class: "bound" }, `${bound} ${unit === "1" ? "" : unit}`),
      el("td", {}, counts.filter(Boolean).join(", ")),
    );
  });
  const aims = study.objectives.map(([metric, sense]) =>
    el("tr", {}, el("th", {}, words(metric)), el("td", {}, sense === "min" ? "small is better" : "large is better")),
  );
  return el(
    "div",
    {},
    el("h3", {}, "Objectives"),
    aims.length ? el("table", {}, ...aims) : el("p", {}, "none"),
    el("h3", {}, "Constraints"),
    rows.length ? el("table", {}, ...rows) : el("p", {}, "none"),
    ...(study.nearest ? nearest(study.nearest, choose) : []),
  );
}

const amount = (value, unit) => `${number(value)} ${unit === "1" ? "" : unit}`.trim();

/** How many designs a constraint excludes alone, and by how much to relax it to let some of them in. */
function relaxations({ alone, lets_in }, metric, unit) {
  const widths = lets_in[metric].map(([designs, width]) => `${amount(width, unit)} lets in ${count(designs)}`);
  return [`alone by ${count(alone[metric])}`, widths.length ? `relaxed by ${widths.join(", ")}` : ""];
}

/** The designs nearest to feasible, and the constraints that are most often missed together. */
function nearest({ designs, together }, choose) {
  const rows = designs.map(([design, , missed, unknown]) => {
    const misses = missed.map(([metric, by, unit]) => `${words(metric)} by ${amount(by, unit)}`);
    const rest = unknown.length ? `; ${unknown.map(words).join(", ")} not known` : "";
    const name = el("button", { type: "button", class: "link", onclick: () => choose(design) }, `design ${count(design)}`);
    return el("tr", {}, el("th", {}, name), el("td", {}, `misses ${misses.join(", ")}${rest}`));
  });
  const pairs = together.map(([metrics, designs_]) =>
    el("tr", {}, el("th", {}, count(designs_)), el("td", {}, `miss ${metrics.map(words).join(", ")} together`)),
  );
  return [
    ...(rows.length ? [el("h3", {}, "Nearest to feasible"), el("table", {}, ...rows)] : []),
    ...(pairs.length ? [el("h3", {}, "Missed together"), el("table", {}, ...pairs)] : []),
  ];
}

function provenance(study) {
  const rows = [
    ["report by", `explore ${study.version}`],
    ["window", study.window],
    ["drive stroke", study.drive],
    ...study.facts,
  ]
    .filter(([, value]) => value)
    .map(([name, value]) => el("tr", {}, el("th", {}, words(name)), el("td", {}, value)));
  return el("div", { class: "provenance" }, el("h3", {}, "Provenance"), el("table", {}, ...rows));
}
