"""Functions that are made from tables: their cache, their translation for a page, their way to workers."""

import ctypes
import gc
import math
import os
import shutil
import stat
import subprocess
import sys
import textwrap
import weakref

import numpy as np
import pytest
from linkage_cases import AMOUNTS, CASES, FOUR_BAR, curved_shaper, linkage_of, loaded_shaper, values_of
from numba import config
from test_pin_friction import DESIGN as ROUGH_DESIGN
from test_pin_friction import ROUGH

import explore
from explore.base.lanes.designs import fill_motion_of_design
from explore.evaluation.evaluate import evaluate_columns
from explore.figures.reporting.javascript import translate
from explore.mechanisms.linkages import declaration, native_code
from explore.mechanisms.registry import MECHANISMS
from explore.studies.request import requests

#: A slider-crank under load with two points of its rod.
LOADED_SLIDER = {
    "crank": 100.0, "rod": 300.0, "offset": 40.0, "speed": 3.0, "mass": 2.0, "opposing_force": 50.0,
    "knife_along": 120.0, "knife_across": 40.0, "tip_along": -30.0, "tip_across": 5.0,
}  # fmt: skip
#: A function in LLVM's language that gives a number.
TEXT = "define double @number() {{\n  ret double {}.0\n}}\n"


@pytest.fixture
def home(tmp_path, monkeypatch):
    """A cache of its own, which is empty."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    native_code._folder.cache_clear()
    yield tmp_path / "explore" / "linkages"
    native_code._folder.cache_clear()


def load(number):
    """What a new function gives that returns this number."""
    function = native_code.NativeFunction(
        "number", "float64()", lambda: TEXT.format(number), lambda text: {}, lambda name, word_of: ""
    )
    return ctypes.CFUNCTYPE(ctypes.c_double)(function.__wrapper_address__())()


#: Caches that keep functions of tables.
CACHES = declaration.linkage_mechanism, declaration._specialise, requests._plain_request


def forget_functions():
    """All functions of tables are made anew."""
    for cached in CACHES:
        cached.cache_clear()
    gc.collect()


def test_code_is_kept_in_a_folder_of_the_user_alone(home, monkeypatch):
    assert load(3) == 3.0
    assert stat.S_IMODE(home.stat().st_mode) == 0o700
    (path,) = home.glob("linkage_*.o")
    assert stat.S_IMODE(path.stat().st_mode) & 0o077 == 0
    monkeypatch.setattr(native_code, "_write", pytest.fail)  # it would be translated anew
    assert load(3) == 3.0


def test_memory_is_bounded():
    """A service reads tables without end: mechanisms, by name, and their functions go when others were used since."""
    linkage = linkage_of(CASES["hoecken"])
    name = linkage.mechanism.name
    assert name in MECHANISMS
    request = requests.make_request(linkage.mechanism, metrics=["rocker_velocity_rms"], window="cycle")
    fill = weakref.ref(request.kernel.fill)
    evaluate_columns(request, {key: np.array([value]) for key, value in values_of(CASES["hoecken"]).items()})
    del linkage, request
    assert all(cached.cache_parameters()["maxsize"] <= 256 for cached in CACHES)
    forget_functions()
    assert name not in MECHANISMS
    assert fill() is None


@pytest.mark.parametrize("damaged", [b"", b"\xff\x00 no code", bytes(32)])
def test_damaged_code_is_translated_anew(home, damaged):
    load(3)
    (path,) = home.glob("linkage_*.o")
    whole = path.read_bytes()
    for content in (damaged, whole[:-1], whole[:-1] + bytes([whole[-1] ^ 1])):
        path.write_bytes(content)
        assert load(3) == 3.0
        assert path.read_bytes() == whole


def test_code_of_another_processor_is_not_used(home, monkeypatch):
    load(3)
    monkeypatch.setattr(config, "CPU_NAME", "x86-64")
    assert load(3) == 3.0
    assert len(list(home.glob("linkage_*.o"))) == 2


def test_a_folder_that_others_can_write_is_not_used(home):
    home.mkdir(parents=True)
    home.chmod(0o777)
    assert load(3) == 3.0
    assert list(home.iterdir()) == []


def test_the_cache_is_bounded(home, monkeypatch):
    monkeypatch.setattr(native_code, "MOST_FILES", 3)
    for number in range(6):
        load(number)
        os.utime(max(home.glob("*.o"), key=os.path.getmtime), (number, number))
    assert len(list(home.iterdir())) == 3


def test_a_full_disk_costs_the_cache_alone(home, monkeypatch):
    def refuse(*_args, **_kwargs):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(native_code.tempfile, "NamedTemporaryFile", refuse)
    assert load(3) == 3.0


def test_long_texts_are_translated_without_effort_to_the_same_numbers(home, monkeypatch):
    """But for the last digits: with effort more products and sums are fused, and round once."""
    case, rows, sizes = CASES["watt-2"], [], []
    for most in (10**6, 0):
        monkeypatch.setattr(native_code, "_MOST_LINES", most)
        forget_functions()
        linkage = linkage_of(case)
        metrics = [f"{each.name}_rms" for each in linkage.mechanism.signals if each.name.endswith("velocity")]
        rows.append(explore.evaluate(linkage, values_of(case), metrics=metrics).iloc[0].to_dict())
        sizes.append(sum(path.stat().st_size for path in home.glob("*.o")) - sum(sizes))
    forget_functions()
    # some roundings of a dozen operations
    assert rows[0] == pytest.approx(rows[1], rel=1e-14)
    assert sizes[1] > sizes[0]


def test_names_never_enter_the_text():
    linkage = explore.Linkage(
        {
            "driver": "driver_that_is_named",
            "frame": {"O": [0, 0], "C": ["ground_that_is_named", 0]},
            "links": {
                "driver_that_is_named": {"O": 0, "A": "r"},
                "rod_that_is_named": {"A": 0, "B": "l"},
                "rocker_that_is_named": {"C": 0, "B": "k"},
            },
            "branch": {"B": "left of A C"},
        }
    )
    mechanism = linkage.mechanism
    for function in (mechanism.precise_close, mechanism.fill, mechanism.disturbed_fill, mechanism.precise_fill):
        text = function.write()
        assert "define ptr @" in text
        assert "that_is_named" not in text
    assert "that_is_named" not in translate(close=mechanism.close, fill=mechanism.fill)


#: A four-bar with a point whose coordinates take all functions of expressions.
ALL_FUNCTIONS = {
    **FOUR_BAR,
    "parameters": {"x": {"unit": "1"}, "y": {"unit": "1"}},
    "links": {
        **FOUR_BAR["links"],
        "rocker": {
            "C": 0,
            "B": "r3",
            "P": [
                "exp(x / 50) + log(x) * sin(x) - min(x, y) * cos(2 * x) + x**2",
                "hypot(x, 7) + atan2(x, 9) + tan(x / 3) + max(x, y)**1.5 + abs(y - x) + sqrt(x)",
            ],
        },
    },
}
LENGTHS = {"r1": 30.0, "r2": 90.0, "r3": 70.0, "r4": 100.0, "x": 30.0, "y": 27.5}


def test_functions_of_expressions_are_those_of_python():
    """The place of a point in its link, by machine code of all lanes and by Python's mathematics."""
    motion = explore.simulate(explore.Linkage(ALL_FUNCTIONS), LENGTHS, angles=[10.0])
    along = (motion[["B_x", "B_y"]].to_numpy()[0] - [100.0, 0.0]) / 70.0
    place = motion[["P_x", "P_y"]].to_numpy()[0] - [100.0, 0.0]
    x, y = LENGTHS["x"], LENGTHS["y"]
    half, sixty, third = (math.radians(angle) for angle in (x, 2.0 * x, x / 3.0))
    expected = (
        math.exp(x / 50.0) + math.log(x) * math.sin(half) - min(x, y) * math.cos(sixty) + x**2,
        math.hypot(x, 7.0) + math.degrees(math.atan2(x, 9.0)) + math.tan(third) + x**1.5 + x - y + math.sqrt(x),
    )
    found = along @ place, along[0] * place[1] - along[1] * place[0]
    assert found == pytest.approx(expected, rel=1e-13)


@pytest.mark.parametrize("anchor", [0, 1])
@pytest.mark.parametrize(
    ("mechanism", "values"),
    [
        (linkage_of(CASES["watt-2"]).mechanism, values_of(CASES["watt-2"])),
        (explore.Linkage(ALL_FUNCTIONS).mechanism, LENGTHS),
        (loaded_shaper().mechanism, values_of(CASES["crank-shaper"]) | AMOUNTS),
        (curved_shaper().mechanism, values_of(CASES["crank-shaper"]) | AMOUNTS),
        (ROUGH.mechanism, ROUGH_DESIGN),
        (MECHANISMS["slider-crank"].with_points(("knife", "tip")).extended, LOADED_SLIDER),
    ],
    ids=["watt-2", "all-functions", "loads", "curves", "rough-pins", "points"],
)
def test_a_page_computes_the_same_motion(tmp_path, mechanism, values, anchor):
    """By close and fill in JavaScript, in Node.js, to the last bits: the order of sums may differ.

    The number of the law is that of the anchor.
    """
    node = shutil.which("node")
    if node is None:
        pytest.skip("node is not installed")
    needs = int(np.bitwise_or.reduce([signal.needs for signal in mechanism.signals]))
    designs = np.array([[values.get(p.name, p.default)] for p in mechanism.kernel_parameters])
    expected = np.zeros((mechanism.signal_rows, 1))
    fill_motion_of_design(
        mechanism.fill, np.ascontiguousarray(mechanism.constants(designs)[:, 0]), np.array([anchor]),
        np.array([anchor]), np.array([0.3]), 0, needs, mechanism.signal_rows, expected,
    )  # fmt: skip
    script = textwrap.dedent(f"""
        const f = {translate(close=mechanism.close, fill=mechanism.fill)};
        const record = new Float64Array({mechanism.record_rows});
        record.set({designs[:, 0].tolist()}, {mechanism.first_parameter});
        f.close(record);
        const out = new Float64Array({mechanism.signal_rows});
        f.fill(record, new Float64Array([0.3]), {anchor}, {anchor}, 0, 1, {needs}, out);
        console.log([record[{mechanism.status_row}], ...out].join());
    """)
    (tmp_path / "page.js").write_text(script)
    run = subprocess.run([node, str(tmp_path / "page.js")], capture_output=True, text=True, check=True)
    status, *found = map(float, run.stdout.split(","))
    assert status == 1.0
    assert found == pytest.approx(expected[:, 0].tolist(), rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("others", [["time_ratio", "ram_velocity_max_forward"], ["assembly_intervals"]])
def test_workers_in_other_processes_get_the_table(tmp_path, others):
    """Two worker processes that know no table compute the rows of this one, bit for bit: strokes and intervals too."""
    case = CASES["crank-shaper"]
    study = explore.Study(
        mechanism=loaded_shaper(),
        parameters={**values_of(case), **AMOUNTS, "crank": {"start": 40, "stop": 160, "num": 50}},
        metrics=["ram_velocity_max", "transmission_angle_min", "drive_torque_max", "pin_force_peak", *others],
    )
    own = explore.sweep(study, tmp_path / "own.h5").to_pandas()
    theirs = explore.sweep(study, tmp_path / "theirs.h5", processes=True, workers=2).to_pandas()
    assert own.equals(theirs)
    assert own[others].notna().to_numpy().any(axis=0).all()


def test_a_folder_for_a_process_alone_goes_with_it(tmp_path):
    """Where no cache can be had: its place is a file."""
    temporary, taken = tmp_path / "temporary", tmp_path / "taken"
    temporary.mkdir()
    taken.touch()
    script = "from explore.mechanisms.linkages import native_code; print(native_code._folder().is_dir())"
    environment = {**os.environ, "XDG_CACHE_HOME": str(taken), "TMPDIR": str(temporary)}
    run = subprocess.run([sys.executable, "-c", script], env=environment, capture_output=True, text=True, check=True)
    assert run.stdout == "True\n"
    assert list(temporary.iterdir()) == []


def test_two_processes_fill_the_cache_at_once(tmp_path):
    """Both compile the same linkage from an empty cache, and give the same number."""
    script = textwrap.dedent("""
        import explore
        linkage = explore.Linkage({"driver": "a", "frame": {"O": [0, 0], "C": ["g", 0]}, "branch": {"B": "left of A C"},
            "links": {"a": {"O": 0, "A": "r"}, "b": {"A": 0, "B": "l"}, "c": {"C": 0, "B": "k"}}})
        row = explore.evaluate(linkage, {"r": 30, "l": 90, "k": 70, "g": 100}, metrics=["c_velocity_rms"])
        print(repr(float(row["c_velocity_rms"].iloc[0])))
    """)
    environment = {**os.environ, "XDG_CACHE_HOME": str(tmp_path)}
    runs = [
        subprocess.Popen([sys.executable, "-c", script], env=environment, stdout=subprocess.PIPE, text=True)
        for _ in range(2)
    ]
    printed = [run.communicate(timeout=600)[0] for run in runs]
    assert [run.returncode for run in runs] == [0, 0]
    assert printed[0] == printed[1] != ""
