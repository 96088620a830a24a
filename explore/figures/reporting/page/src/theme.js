/** Dark or light: as the system, unless chosen on the page; canvases read their colours from the page's style. */

const NAMES = [
  "ink",
  "muted",
  "faint",
  "line",
  "panel",
  "blue",
  "green",
  "red",
  "orange",
  "purple",
  "sky",
  "stroke",
  "accent",
  "ramp",
];
const listeners = [];
let current = null;

/** Colours of the current theme by name. */
export function colours() {
  if (!current) {
    const style = getComputedStyle(document.documentElement);
    current = Object.fromEntries(NAMES.map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
  }
  return current;
}

/** Call whenever the colours have changed. */
export const onTheme = (listener) => listeners.push(listener);

function changed() {
  current = null;
  for (const listener of listeners) listener();
}

const dark = matchMedia("(prefers-color-scheme: dark)");
const print = matchMedia("print");

/** Whether the page is dark now. */
export const isDark = () => (document.documentElement.dataset.theme ?? (dark.matches ? "dark" : "light")) === "dark";

/** Change to the other theme. */
export function toggle() {
  document.documentElement.dataset.theme = isDark() ? "light" : "dark";
  changed();
}

dark.addEventListener("change", changed);
print.addEventListener("change", changed);
addEventListener("beforeprint", changed);
addEventListener("afterprint", changed);
