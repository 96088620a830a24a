// Formulas are marked by the build and drawn here, by the KaTeX beside this file.
document$.subscribe(() => {
  for (const formula of document.querySelectorAll(".arithmatex")) {
    const text = formula.textContent.trim();
    katex.render(text.slice(2, -2), formula, { displayMode: text.startsWith("\\["), output: "html" });
  }
});
