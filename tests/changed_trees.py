"""Contents of TOML files with a few of their values changed, at any depth, and their text."""

import datetime
import json
import math

from hypothesis import strategies as st

CHANGES = ("replace", "replace", "replace", "copy", "remove", "rename", "add")


def change(draw, tree, keys, values, most):
    """Replace, copy, remove, rename or add up to so many values of a tree in place; return it."""
    for _ in range(draw(st.integers(1, most))):
        place = tree
        while True:
            known = list(place) if isinstance(place, dict) else list(range(len(place)))
            if not known:
                break
            key = draw(st.sampled_from(known))
            if not isinstance(place[key], dict | list) or draw(st.integers(0, 5)) == 0:
                break
            place = place[key]
        kind = draw(st.sampled_from(CHANGES))
        if kind == "add" or not known:
            place.update({draw(keys): draw(values)}) if isinstance(place, dict) else place.append(draw(values))
        elif kind == "replace":
            place[key] = draw(values)
        elif kind == "copy":
            place[key] = place[draw(st.sampled_from(known))]
        elif kind == "remove":
            del place[key]
        elif isinstance(place, dict):
            place[draw(keys)] = place.pop(key)
    return tree


def toml(value):
    """A value as TOML."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, list):
        return f"[{', '.join(map(toml, value))}]"
    if isinstance(value, dict):
        return "{" + ", ".join(f"{toml(key)} = {toml(item)}" for key, item in value.items()) + "}"
    if isinstance(value, datetime.date | datetime.time):
        return value.isoformat()
    return repr(value) if isinstance(value, int) or not math.isnan(value) else "nan"


def text_of(tree):
    """The text of a file."""
    return "".join(f"{toml(key)} = {toml(value)}\n" for key, value in tree.items())
