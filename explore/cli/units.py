"""The option --units, and results in the units that it or their study chooses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated

import typer

from explore.base.errors import RequestError

if TYPE_CHECKING:
    from pathlib import Path

    from explore.base.units.shown import ShownUnits
    from explore.results.store.results import Results
    from explore.studies.config.study import Study

#: Entry of --units that leaves out the choices of the study.
_DECLARED = "declared"
#: Quantities that --units takes.
_QUANTITIES = ("length", "angle", "speed", "velocity", "acceleration", "force", "torque", "mass", "power")


UnitsOption = Annotated[
    list[str] | None,
    typer.Option(
        "--units",
        metavar="QUANTITY=UNIT",
        autocompletion=lambda: [*(f"{name}=" for name in _QUANTITIES), _DECLARED],
        help="Show a quantity in this unit, such as length=in or speed=rpm; numbers without a unit on the command line "
        "are in it, too. Several times for several quantities; `declared` leaves out those of the study.",
    ),
]


def choose_units(texts: Sequence[str] | None, study: Mapping[str, object] | None = None) -> ShownUnits:
    """The units of --units, and of [units] of the study where the option does not name the quantity."""
    from explore.base.units.shown import explain_entry, read_shown_units

    entries = dict(study or {})
    for text in texts or ():
        name, equals, unit = text.partition("=")
        if text == _DECLARED:
            entries = {}
            continue
        if not equals:
            raise RequestError(f"--units {text}: write QUANTITY=UNIT, such as length=in, or {_DECLARED}")
        if reason := explain_entry(name, unit):
            raise RequestError(f"--units {text}: {reason}")
        entries[name] = unit
    return read_shown_units(entries)


def units_of_designs(texts: Sequence[str] | None, study: Study) -> ShownUnits:
    """The units in which the designs of a study are told: as `choose_units`, and rpm for speeds that are given so."""
    from explore.results.store.study_units import units_as_given

    declared = {parameter.name: parameter.unit for parameter in study.request.mechanism.parameters}
    given = {} if _DECLARED in (texts or ()) else units_as_given(study.to_toml(), declared)
    return choose_units(texts, study.units.units).with_given(given)


def open_shown(path: Path, texts: Sequence[str] | None) -> Results:
    """Open results in the units of their study and of --units."""
    from explore.results.store.open_results import open_results

    results = open_results(path)
    return results.in_units(units_of(results, texts))


def open_all_shown(paths: Sequence[Path], texts: Sequence[str] | None) -> list[Results]:
    """Open several results in the units of the study of the first and of --units."""
    from explore.results.store.open_results import open_results

    opened = [open_results(path) for path in paths]
    units = units_of(opened[0], texts)
    return [results.in_units(units) for results in opened]


def units_of(results: Results, texts: Sequence[str] | None) -> ShownUnits:
    """The units of the study of results, and of --units."""
    from explore.results.store.study_units import given_units, units_of_study

    entries = units_of_study(results)
    given = {} if _DECLARED in (texts or ()) else given_units(results)
    try:
        return choose_units(texts, entries).with_given(given)
    except RequestError as error:
        if str(error).startswith("--units"):
            raise
        raise RequestError(f"{results.path}: [units] {error}; --units {_DECLARED} leaves them out") from None
