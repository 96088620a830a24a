"""The study of an atlas of coupler curves, which its results hold."""

from importlib.resources import files

#: Line of the study with the number of curves.
_COUNT = "count = 65536"


def atlas_text(count: int) -> str:
    """The study of an atlas of so many linkages."""
    text = files("explore").joinpath("data/atlas.toml").read_text(encoding="utf-8")
    return text.replace(_COUNT, f"count = {count}")
