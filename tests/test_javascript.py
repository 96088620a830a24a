"""Compiled functions in JavaScript: what has no translation is refused with its place."""

import math
import shutil
import subprocess
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from explore.base.compiling import LANES, compiled
from explore.base.subroutines import subroutine
from explore.figures.reporting.javascript import TranslationError, _Program, translate
from explore.mechanisms.linkages import page_code
from explore.mechanisms.linkages.programs import Program
from explore.mechanisms.registry import MECHANISMS

TABLE = (0.5, -2.0)


@subroutine()
def _part(a, b):
    return a // b, a % b


@compiled("void(float64[::1])")
def everything(out):
    default = 3.0
    quotient, rest = _part(-7.0, 2.0)
    out[0], out[1] = quotient, rest
    count = 0
    for j in range(2, 9, 3):
        if j == 5:
            continue
        count += j
    for j in range(4, 0, -2):
        count += 100 * j
    out[2] = count
    while True:
        count -= 1
        if count < 600 or not count > 0:
            break
    out[3] = count
    part = out[4:]
    part[0] = TABLE[1] * default**2 if 0.0 < default <= 3.0 else math.nan
    part[1] = (5 & 3) | (1 << 4)
    part[2] = -math.inf if (default > 1.0) & (count < 0) else math.sqrt(16.0)
    part[3] = min(abs(-2.5), 9.0) + len(out) * LANES


@compiled("void(float64[::1])")
def sorts(out):
    out[0] = np.sort(out)[0]


@compiled("void(float64[::1])")
def lists(out):
    out[0] = sum([1.0, 2.0])


def test_statements_mean_the_same():
    node = shutil.which("node")
    if node is None:
        pytest.skip("node is not installed; the browser's tests compare the mechanisms themselves")
    script = f"const f = {translate(everything=everything)}; const out = new Float64Array(8); f.everything(out);"
    run = subprocess.run([node, "-e", script + "console.log(out.join())"], capture_output=True, text=True, check=True)
    found = [float(word) for word in run.stdout.split(",")]
    expected = np.zeros(8)
    everything(expected)
    expected[7] += 8 - 8 * LANES  # a page computes one design at once
    assert found == expected.tolist() == [-4.0, 1.0, 610.0, 599.0, -18.0, 17.0, 4.0, 10.5]


@compiled("void(float64[::1])")
def assigns_slices(out):
    out[1:3] = 0.0


@compiled("void(float64[::1])")
def assigns_what_it_counts_by(out):
    for k in range(3):
        out[k], k = 1.0, 0


@pytest.mark.parametrize(
    ("function", "line"),
    [
        (assigns_what_it_counts_by, "for k in range(3)"),
        (sorts, "out[0] = np.sort"),
        (assigns_slices, "out[1:3] = 0.0"),
        (lists, "sum([1.0, 2.0])"),
    ],
)
def test_what_has_no_translation_is_refused_with_its_place(function, line):
    with pytest.raises(TranslationError, match=r"test_javascript\.py:\d+: `.*` has no translation") as refusal:
        translate(f=function)
    place, _, _ = str(refusal.value).partition(": `")
    number = int(place.rpartition(":")[2])
    with Path(__file__).open(encoding="utf-8") as file:
        assert line in file.readlines()[number - 1]


def test_all_mechanisms_have_a_translation():
    for mechanism in MECHANISMS.values():
        text = translate(close=mechanism.close, fill=mechanism.fill)
        assert "undefined" not in text
        assert text.count("{") == text.count("}")


def test_literals_of_tables_may_be_infinite():
    literals = {0: math.inf, 1: -math.inf, 2: math.nan, 3: -0.5}
    program = Program("x", (), literals, {}, tuple((k, k) for k in literals), {}, 0)
    lines = page_code.node_function(program, str).splitlines()
    words = ("Infinity", "(-Infinity)", "NaN", "(-0.5)")
    assert lines[-5:-1] == [f"written[{k}] = {word};" for k, word in enumerate(words)]


def test_functions_of_one_name_have_names_of_their_own():
    class Compiled:
        def __init__(self, name):
            self.py_func = SimpleNamespace(__module__="module", __name__=name)

    program = _Program()
    names = [program.name_of(Compiled(name)) for name in ("f", "f", "f1", "f1")]
    assert len(set(names)) == 4, names
