/** The button that changes between light and dark, which the pages of this service remember on this machine. */

import { isDark, onTheme, toggle } from "../../../figures/reporting/page/src/theme.js";

const KEY = "explore-theme";

/** What is remembered, or with `value` remember it; nothing where the browser keeps nothing. */
function remembered(value) {
  try {
    if (value) localStorage.setItem(KEY, value);
    return localStorage.getItem(KEY);
  } catch {
    return null;
  }
}

/** @param {HTMLButtonElement} button */
export function themeButton(button) {
  const label = () => (button.textContent = isDark() ? "Light" : "Dark");
  const theme = remembered();
  if (theme === "light" || theme === "dark") document.documentElement.dataset.theme = theme;
  button.onclick = () => {
    toggle();
    remembered(isDark() ? "dark" : "light");
  };
  onTheme(label);
  label();
}
