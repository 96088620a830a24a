"""Draw the packages of `explore` and the imports between them: ``python docs/architecture_diagram.py`` in the root.

Writes docs/architecture.svg and prints the counts. Every package stands above all that it imports; an arrow that others
imply (a imports b, b imports c, a imports c) is left out.
"""

import ast
import sys
from graphlib import CycleError, TopologicalSorter
from html import escape
from pathlib import Path

HERE = Path(__file__).parent
DIAGRAM = HERE / "architecture.svg"
#: The packages that compute with arrays only; pyproject.toml has the contract.
CORE = {"base", "model", "mechanisms", "evaluation"}
WIDTH, ROW, BOX_HEIGHT, LETTER = 940, 62, 28, 7.6


def read_modules(package):
    """Path of each module by its dotted name."""
    names = {}
    for path in sorted(package.rglob("*.py")):
        parts = path.relative_to(package.parent).with_suffix("").parts
        names[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return names


def imported_modules(path, modules):
    """Names of the package's own modules that a file imports anywhere, also inside functions."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module:
            for alias in node.names:
                name = f"{node.module}.{alias.name}"
                yield name if name in modules else node.module
        elif isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)


def module_imports(package):
    """The modules of the package that each of its modules imports."""
    modules = read_modules(package)
    return {name: set(imported_modules(path, modules)) & modules.keys() - {name} for name, path in modules.items()}


def unit_imports(imports):
    """The top-level packages and modules that each of them imports."""
    units = {name.split(".")[1] for name in imports if "." in name} - {"_version", "__main__", "charts", "sizing"}
    between = {unit: set() for unit in units}
    for name, others in imports.items():
        unit = name.partition(".")[2].partition(".")[0]
        if unit in units:
            between[unit] |= {other.split(".")[1] for other in others if "." in other} & units - {unit}
    return between


def find_levels(imports):
    """Level of each unit, 0 at the bottom: one above the highest unit that it imports."""
    levels = {}
    for unit in TopologicalSorter(imports).static_order():
        levels[unit] = 1 + max((levels[other] for other in imports[unit]), default=-1)
    return levels


def reduced(imports):
    """The imports that no others imply."""

    def reachable(unit):
        return imports[unit].union(*(reachable(other) for other in imports[unit]))

    return {unit: others - set().union(*(reachable(other) for other in others)) for unit, others in imports.items()}


def arrange(levels, arrows):
    """Centre (x, y) and width of each box: rows by level, in a row by the mean place of the boxes above."""
    places = {}
    for level in range(max(levels.values()), -1, -1):
        row = [unit for unit in sorted(levels) if levels[unit] == level]
        above = {unit: [places[other][0] for other in places if unit in arrows[other]] for unit in row}
        row.sort(key=lambda unit: sum(above[unit]) / len(above[unit]) if above[unit] else WIDTH / 2)
        gap = WIDTH / len(row)
        for position, unit in enumerate(row):
            places[unit] = ((position + 0.5) * gap, (max(levels.values()) - level + 0.5) * ROW, LETTER * len(unit) + 20)
    return places


def diagram(package):
    """The diagram as SVG."""
    imports = unit_imports(module_imports(package))
    arrows = reduced(imports)
    places = arrange(find_levels(imports), arrows)
    height = max(y for _, y, _ in places.values()) + ROW / 2
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height:.0f}" font-family="sans-serif">',
        "<title>The packages of explore and the imports between them</title>",
        f'<rect width="{WIDTH}" height="{height:.0f}" fill="white"/>',
        '<defs><marker id="tip" viewBox="0 0 8 8" refX="8" refY="4" markerWidth="6" markerHeight="6" orient="auto">',
        '<path d="M0 0 8 4 0 8z" fill="#8a94a0"/></marker></defs>',
    ]
    for unit in sorted(places):
        x, y, _ = places[unit]
        for other in sorted(arrows[unit]):
            x2, y2, _ = places[other]
            start, end = y + BOX_HEIGHT / 2, y2 - BOX_HEIGHT / 2 - 1
            bend = (end - start) / 2
            curve = f"M{x:.0f} {start:.0f}C{x:.0f} {start + bend:.0f} {x2:.0f} {end - bend:.0f} {x2:.0f} {end:.0f}"
            parts.append(f'<path d="{curve}" fill="none" stroke="#8a94a0" marker-end="url(#tip)"/>')
    for unit in sorted(places):
        x, y, width = places[unit]
        file = package / unit / "__init__.py"
        text = ast.get_docstring(ast.parse((file if file.exists() else package / f"{unit}.py").read_text("utf-8")))
        fill, edge = ("#e3f1ef", "#12796d") if unit in CORE else ("#f4f5f7", "#5b6672")
        parts += [
            f'<g font-size="13"><title>{escape(text.splitlines()[0])}</title>',
            f'<rect x="{x - width / 2:.0f}" y="{y - BOX_HEIGHT / 2:.0f}" width="{width:.0f}" height="{BOX_HEIGHT}"',
            f'rx="5" fill="{fill}" stroke="{edge}"/>',
            f'<text x="{x:.0f}" y="{y + 4.5:.0f}" text-anchor="middle" fill="#1c232b">{unit}</text></g>',
        ]
    return "\n".join([*parts, "</svg>", ""])


def main():
    """Write the diagram, and print the counts of this package or of the one in the folder given."""
    package = Path(sys.argv[1]) if sys.argv[1:] else HERE.parent / "explore"
    modules = module_imports(package)
    units = unit_imports(modules)
    levels, count = find_levels(units), sum(map(len, units.values()))
    print(f"{len(units)} packages and modules on {1 + max(levels.values())} levels, {count} imports between them")
    try:
        TopologicalSorter(modules).prepare()
    except CycleError as error:
        print("an import cycle:", " -> ".join(error.args[1]))
    if not sys.argv[1:]:
        DIAGRAM.write_text(diagram(package), encoding="utf-8")


if __name__ == "__main__":
    main()
