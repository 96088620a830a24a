/** The results that are browsed: their indexes, columns and constraints, and queries to their routes. */

import { ask } from "./ask.js";
import { raised } from "../../../figures/reporting/page/src/format.js";

/** Milliseconds between two looks at an index that is being made. */
const LOOK = 200;

/** Address of the page of several results. */
export const addressOf = (names) => `/page/browse.html?${names.map((name) => `results=${encodeURIComponent(name)}`).join("&")}`;

const path = (name, route) => `/api/results/${encodeURIComponent(name)}/${route}`;

/** Ask a route of results; lists in the query are repeated keys. */
export function query(source, route, parameters) {
  const pairs = Object.entries(parameters).flatMap(([key, value]) =>
    (Array.isArray(value) ? value : [value]).filter((one) => one !== null && one !== undefined).map((one) => [key, String(one)]),
  );
  return ask("GET", `${path(source.name, route)}?${new URLSearchParams(pairs)}`);
}

/** Begin and await the indexes; `tell` is called with the share that is done. */
export async function waitForIndexes(names, tell) {
  for (const name of names) await ask("GET", path(name, "index?build=true"));
  for (;;) {
    const indexes = await Promise.all(names.map((name) => ask("GET", path(name, "index"))));
    if (indexes.every(({ state }) => state === "ready")) return;
    const failed = indexes.findIndex(({ state }) => state === "none");
    if (failed >= 0) await ask("GET", path(names[failed], "index?build=true"));
    tell(indexes.reduce((sum, { share }) => sum + share, 0) / names.length);
    await new Promise((done) => setTimeout(done, LOOK));
  }
}

/** Facts of all results, each with its columns by name. */
export async function browsingOf(names) {
  return Promise.all(
    names.map(async (name) => {
      const facts = await ask("GET", path(name, "browsing"));
      const columns = facts.columns
        .filter(({ low, high }) => low !== null && high !== null)
        .map((column) => ({ ...column, unit: column.unit === "1" ? "" : raised(column.unit) }));
      return { ...facts, name, columns, byName: new Map(columns.map((column) => [column.name, column])) };
    }),
  );
}

/** Names of the columns that matter most, first: constrained, objectives, swept parameters, other metrics. */
export function byWeight({ columns, constraints, objectives, byName }) {
  const constrained = constraints.map(({ metric }) => metric);
  const aims = objectives.map((text) => text.split(":")[0]);
  const swept = columns.filter(({ kind, distinct }) => kind === "parameter" && distinct !== 1).map(({ name }) => name);
  const metrics = columns.filter(({ kind }) => kind === "metric").map(({ name }) => name);
  return [...new Set([...constrained, ...aims, ...swept, ...metrics])].filter((name) => byName.has(name));
}
