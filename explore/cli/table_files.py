"""Tables of designs as files: CSV, JSON, Markdown or Parquet, by the ending of the name; figures beside them."""

from __future__ import annotations

from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from explore.base.errors import RequestError
from explore.base.json_text import json_text
from explore.cli.output import count_of, number, print_json, say
from explore.cli.paths import FIGURE_ENDINGS, TABLE_ENDINGS, check_output
from explore.results.store.table_words import with_labels as with_labels
from explore.results.store.table_words import with_units as with_units

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    import pandas as pd
    from matplotlib.figure import Figure


def check_table(path: Path | None) -> None:
    """Refuse a file that cannot be written, before anything is computed."""
    check_output(path, TABLE_ENDINGS)
    if path is not None and path.suffix.lower() == ".parquet" and find_spec("pyarrow") is None:
        raise RequestError(
            f'-o {path}: Parquet needs pyarrow: pip install "linkage-explore[parquet]"; .csv needs nothing'
        )


def check_outputs(paths: Sequence[Path], others: Sequence[str] = ()) -> None:
    """Refuse tables, figures and files with other endings that cannot be written."""
    for path in paths:
        check_output(path, (*others, *FIGURE_ENDINGS, *TABLE_ENDINGS))
        if path.suffix.lower() in TABLE_ENDINGS:
            check_table(path)


def write_output(path: Path, frame: pd.DataFrame, units: Mapping[str, str], kind: str, drawn: object) -> None:
    """Write a table, or the figure of a kind of what is drawn, by the ending of the name, and say so."""
    if path.suffix.lower() in TABLE_ENDINGS:
        write_table(frame, path, units)
    else:
        from explore.figures.charts.style import save_figure

        save_figure(load_chart(kind)(drawn), path)
    say(f"wrote {path}")


def load_chart(kind: str) -> Callable[..., Figure]:
    """The function of a kind of chart, by its public name."""
    chart: Callable[..., Figure] = getattr(import_module("explore.charts"), f"{kind}_chart")
    return chart


def tell_designs(frame: pd.DataFrame, output: Path | None, units: Mapping[str, str], *, as_json: bool) -> bool:
    """Write the designs if a file is given, and print them as JSON if that is asked for; whether it is."""
    if output is not None:
        write_table(frame, output, units)
        say(f"wrote {count_of(len(frame), 'design')} to {output}")
    if as_json:
        print_json(frame.reset_index().to_dict(orient="records"))
    return as_json


def write_all(folder: Path, tables: Mapping[str, pd.DataFrame], charts: Mapping[str, Figure]) -> None:
    """Write tables as CSV, and charts as PNG and SVG, by name into a folder."""
    from explore.figures.charts.style import save_figure

    for name, frame in tables.items():
        frame.to_csv(folder / f"{name}.csv", index=False)
    for name, figure in charts.items():
        for kind in ("png", "svg"):
            save_figure(figure, folder / f"{name}.{kind}")


def write_table(frame: pd.DataFrame, path: Path, units: Mapping[str, str]) -> None:
    """Write a table with its index; the file appears when it is complete."""
    from explore.results.store.outputs import new_output

    ending = path.suffix.lower()
    with new_output(path) as unfinished:
        if ending == ".csv":
            frame.to_csv(unfinished)
        elif ending == ".parquet":
            frame.to_parquet(unfinished, engine="pyarrow")
        else:
            text = (
                markdown(frame, units) if ending == ".md" else json_text(frame.reset_index().to_dict(orient="records"))
            )
            unfinished.write_text(text + "\n", encoding="utf-8")


def markdown(frame: pd.DataFrame, units: Mapping[str, str]) -> str:
    """A Markdown table with rounded numbers, and units after the names."""
    table = frame.reset_index()
    names = [str(name) for name in table.columns]
    headings = [
        f"{_cell(name)} ({_cell(units[name])})" if units.get(name, "1") not in ("", "1") else _cell(name)
        for name in names
    ]
    lines = [headings, ["---:"] * len(names)]
    lines += [[_cell(number(value)) for value in row] for row in table.astype(object).itertuples(index=False)]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def _cell(text: str) -> str:
    """The text with the characters replaced that would end its cell."""
    return "".join(letter if letter.isprintable() else "?" for letter in text).replace("|", "\\|")
