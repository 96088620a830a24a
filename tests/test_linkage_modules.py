"""Modules that are made from tables: their cache, their translation for a page, their way to workers."""

import gc
import os
import shutil
import stat
import subprocess
import sys
import textwrap
from pathlib import Path

import numpy as np
import pytest
from linkage_cases import CASES, linkage_of, values_of

import explore
from explore.base.lanes.designs import fill_motion_of_design
from explore.figures.reporting.javascript import translate
from explore.mechanisms.linkages import declaration, modules
from explore.mechanisms.registry import MECHANISMS

TEXT = "import math\n\n\ndef half_turn():\n    return math.pi\n"


@pytest.fixture
def home(tmp_path, monkeypatch):
    """A cache of its own, which is empty."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    modules._folder.cache_clear()
    modules._MODULES.clear()
    yield tmp_path / "explore" / "linkages"
    modules._folder.cache_clear()
    modules._MODULES.clear()


def test_a_module_is_kept_in_a_folder_of_the_user_alone(home):
    assert modules.load_module(TEXT).half_turn() == np.pi
    assert stat.S_IMODE(home.stat().st_mode) == 0o700
    (path,) = home.glob("linkage_*.py")
    assert path.read_text() == TEXT


def test_memory_is_bounded(home, monkeypatch):
    """A service reads tables without end: modules, and mechanisms by name, go when others were used since."""
    monkeypatch.setattr(modules, "MOST_MODULES", 3)
    loaded = [modules.load_module(f"{TEXT}# {number}\n") for number in range(5)]
    assert [sys.modules.get(module.__name__) is module for module in loaded] == [False, False, True, True, True]
    assert modules.load_module(f"{TEXT}# 4\n") is loaded[4]

    name = linkage_of(CASES["hoecken"]).mechanism.name
    assert name in MECHANISMS
    for cached in (declaration.linkage_mechanism, declaration._specialise):
        assert cached.cache_parameters()["maxsize"] <= 256
        cached.cache_clear()
    gc.collect()
    assert name not in MECHANISMS


def test_a_damaged_module_is_written_anew(home):
    modules.load_module(TEXT)
    (path,) = home.glob("linkage_*.py")
    path.write_bytes(b"\xff\x00 not a module")
    modules._MODULES.clear()
    assert modules.load_module(TEXT).half_turn() == np.pi
    assert path.read_text() == TEXT


def test_a_folder_that_others_can_write_is_not_used(home):
    home.mkdir(parents=True)
    home.chmod(0o777)
    module = modules.load_module(TEXT)
    assert module.half_turn() == np.pi
    assert list(home.iterdir()) == []
    assert not module.__file__.startswith(str(home))


def test_the_cache_is_bounded(home, monkeypatch):
    monkeypatch.setattr(modules, "MOST_MODULES", 3)
    for number in range(6):
        modules.load_module(f"{TEXT}# {number}\n")
        os.utime(max(home.glob("*.py"), key=os.path.getmtime), (number, number))
    assert len(list(home.glob("linkage_*.py"))) == 3


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
    path = Path(linkage.mechanism.fill.py_func.__code__.co_filename)
    assert "that_is_named" not in path.read_text(encoding="utf-8")


def test_a_page_computes_the_same_motion(tmp_path):
    """By the translation of close and fill, in Node.js, to the last bits: the order of sums may differ."""
    node = shutil.which("node")
    if node is None:
        pytest.skip("node is not installed")
    case = CASES["watt-2"]
    mechanism, values = linkage_of(case).mechanism, values_of(case)
    designs = np.array([[values[p.name]] for p in mechanism.kernel_parameters])
    expected = np.zeros((mechanism.signal_rows, 1))
    fill_motion_of_design(
        mechanism.fill, np.ascontiguousarray(mechanism.constants(designs)[:, 0]), np.zeros(1, np.int64),
        np.zeros(1, np.int64), np.array([0.3]), 0, 1, mechanism.signal_rows, expected,
    )  # fmt: skip
    script = textwrap.dedent(f"""
        const f = {translate(close=mechanism.close, fill=mechanism.fill)};
        const record = new Float64Array({mechanism.record_rows});
        record.set({designs[:, 0].tolist()}, {mechanism.first_parameter});
        f.close(record);
        const out = new Float64Array({mechanism.signal_rows});
        f.fill(record, new Float64Array([0.3]), 0, 0, 0, 1, 1, out);
        console.log([record[{mechanism.status_row}], ...out].join());
    """)
    (tmp_path / "page.js").write_text(script)
    run = subprocess.run([node, str(tmp_path / "page.js")], capture_output=True, text=True, check=True)
    status, *found = map(float, run.stdout.split(","))
    assert status == 1.0
    assert found == pytest.approx(expected[:, 0].tolist(), rel=1e-12, abs=1e-12)


def test_workers_in_other_processes_get_the_table(tmp_path):
    """Two worker processes that know no table compute the rows of this one, bit for bit."""
    case = CASES["crank-shaper"]
    study = explore.Study(
        mechanism=linkage_of(case),
        parameters={**values_of(case), "crank": {"start": 40, "stop": 60, "num": 50}},
        metrics=["ram_velocity_max", "transmission_angle_min"],
    )
    own = explore.sweep(study, tmp_path / "own.h5").to_pandas()
    theirs = explore.sweep(study, tmp_path / "theirs.h5", processes=True, workers=2).to_pandas()
    assert own.equals(theirs)


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
