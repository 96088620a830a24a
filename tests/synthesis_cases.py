"""The reference cases of synthesis, by name."""

import json
from functools import cache
from pathlib import Path

_FILE = Path(__file__).parent / "reference" / "synthesis.json"


@cache
def _cases():
    return {case["id"]: case for case in json.loads(_FILE.read_text(encoding="utf-8"))["cases"]}


def case(name):
    """The inputs and outputs of a case."""
    found = _cases()[name]
    return found["inputs"], found["outputs"]


def plane(pair):
    """A point of the plane from two decimal texts."""
    return complex(float(pair[0]), float(pair[1]))
