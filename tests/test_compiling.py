"""The compiled kernels: vectorised, found in the cache by a second process, announced when they are compiled."""

import gc
import importlib
import json
import os
import platform
import shutil
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from textwrap import indent

import numpy as np
import pytest
from numba import njit, types
from studies import GOOD

from explore.base import compiler_passes
from explore.base.compiler_passes import PlainCompiler, quick_compilation
from explore.mechanisms.registry import MECHANISMS

REPORT = """
import json
from explore.evaluation.evaluate import compile_kernels
from explore.base.lanes.designs import close_all
from explore.evaluation.quadrature.loop import sample_moments
from explore.mechanisms.registry import MECHANISMS
from explore.studies.request.requests import make_request
mechanism = MECHANISMS["crank-rocker"]
compile_kernels(make_request(mechanism))
functions = {"sample_moments": sample_moments, "close_all": close_all, "close": mechanism.close, "fill": mechanism.fill}
stats = {name: [f.stats.cache_hits.total(), f.stats.cache_misses.total()] for name, f in functions.items()}
"""


def report(cache, script):
    process = subprocess.run(
        [sys.executable, "-c", script],
        cwd=cache,  # as in `sweep`: Numba's cache belongs to one installed package
        env={**os.environ, "NUMBA_CACHE_DIR": str(cache)},
        capture_output=True,
        text=True,
        check=True,
        timeout=300,
    )
    return json.loads(process.stdout)


def sweep(folder, cache, *options, before="", after=""):
    """What `explore sweep` of one design says in a process of its own, and what scripts before and after it print."""
    (folder / "one.toml").write_text(GOOD)
    script = f"{before}\nfrom explore.cli import main\ntry:\n    main()\nfinally:\n    pass\n{indent(after, '    ')}"
    process = subprocess.run(
        [sys.executable, "-c", script, "sweep", "one.toml", *options],
        cwd=folder,
        env={**os.environ, "NUMBA_CACHE_DIR": str(cache)},
        capture_output=True,
        text=True,
        check=True,
        timeout=300,
    )
    return process.stderr, process.stdout


#: A function that counts packed and single instructions in the machine code of functions, by the part of each.
COUNTING = """
import json, re
def counts_of(functions):
    parts = {}
    for function in functions:
        (code,) = function.inspect_asm().values()
        found = re.split(r"^(?:\\.L)?_ZN\\w*?\\d([a-z_]+)B\\d\\S*:", code, flags=re.MULTILINE)
        for name, part in zip(found[1::2], found[2::2]):
            counts = [len(re.findall(r"\\tv?" + word, part)) for word in ("divpd", "sqrtpd", "sqrtsd")]
            parts.setdefault(f"{function.__module__}.{name}", counts)
    return json.dumps(parts)
"""
#: A script that counts those of what a sweep of a crank-rocker compiled.
OF_SWEEP = f"""{COUNTING}
from explore.evaluation.quadrature import loop
from explore.mechanisms.crank_rocker import kernel
print(counts_of([loop.sample_moments, kernel.close, kernel.fill]))
"""


@pytest.fixture(scope="module")
def first(tmp_path_factory):
    """The cache of the compiled kernels after the first command on a machine, what that said, and what it compiled."""
    cache = tmp_path_factory.mktemp("numba")
    return cache, *sweep(tmp_path_factory.mktemp("first"), cache, after=OF_SWEEP)


def remove_closed_form(cache):
    """Remove the evaluation of closed forms from the cache."""
    (index,) = cache.rglob("designs.close_all*.nbi")
    index.unlink()


def test_a_second_process_compiles_nothing(first):
    lookups = report(first[0], f"{REPORT}print(json.dumps(stats))")

    assert all((hits, misses) == (1, 0) for hits, misses in lookups.values()), lookups


def test_a_sweep_compiles_its_own_mechanism_only(first):
    compiled = {path.name.split("-")[0] for path in first[0].rglob("*.nbi")}

    assert "kernel.close" in compiled
    assert len(list(first[0].rglob("kernel.close-*.nbi"))) == 1
    assert len(list(first[0].rglob("loop._sample-*.nbc"))) == 1  # without what few requests need
    assert not any(name.startswith("extended.") for name in compiled), compiled


#: Functions of the compiled loop whose loops over lanes or designs vectorise, as all of mechanisms do.
LOOPS = ("choose_equispaced", "count_nodes", "map_panels", "collect", "place_nodes")


@pytest.mark.skipif(platform.machine() != "x86_64", reason="reads x86-64 assembly")
def test_the_loops_over_lanes_are_vectorised(first, tmp_path):
    """In the machine code that runs: a loop that vectorises when it is compiled alone need not among its callers."""
    script = f"""{COUNTING}
from explore.base.compiler_passes import quick_compilation
from explore.base.compiling import CLOSE_SIGNATURE, FILL_SIGNATURE
from explore.mechanisms.crank_rocker import extended
from explore.mechanisms.rig import kernel as rig_kernel
from explore.mechanisms.slider_crank import extended as slider_extended, kernel as slider_kernel
from explore.mechanisms.variable_crank import motion
signatures = {{motion.fill: FILL_SIGNATURE}}
for module in (extended, rig_kernel, slider_kernel, slider_extended):
    signatures |= {{module.close: CLOSE_SIGNATURE, module.fill: FILL_SIGNATURE}}
with quick_compilation():
    for function, signature in signatures.items():
        function.compile(signature)
print(counts_of(signatures))
"""
    parts = json.loads(first[2].splitlines()[-1]) | report(tmp_path, script)

    for name, (divisions, roots, single_roots) in parts.items():
        module, function = name.rsplit(".", 1)
        if not module.endswith("loop"):
            assert divisions > 0, name
            assert roots > 0, name
            assert single_roots == 0, name
        elif function in LOOPS:
            assert divisions > 0, name
            assert roots > 0 or single_roots == 0, name  # not only those of a loop's remainder
    assert {name.rsplit(".", 1)[1] for name in parts} >= {*LOOPS, "fill", "close"}


def test_compiling_is_announced_once_and_the_next_start_is_silent(first, tmp_path):
    cache, errors, _ = first

    assert errors.splitlines()[0].startswith("compiling the kernels")
    assert errors.count("compiling") == 1
    assert "compiling" not in sweep(tmp_path, cache)[0]


def test_a_slow_start_is_not_taken_for_compiling(first, tmp_path):
    slow = """
import sys, time
class Slow:
    def find_spec(self, name, path=None, target=None):
        if name == "explore.evaluation.quadrature.loop":
            time.sleep(2)
sys.meta_path.insert(0, Slow())
"""
    begun = time.monotonic()

    assert "compiling" not in sweep(tmp_path, first[0], before=slow)[0]
    assert time.monotonic() - begun > 2


def test_a_quiet_sweep_compiles_silently(first, tmp_path):
    cache = first[0]
    remove_closed_form(cache)

    assert sweep(tmp_path, cache, "--quiet")[0] == ""
    assert list(cache.rglob("designs.close_all*.nbi")), "nothing was compiled, so nothing was tried"


@pytest.mark.parametrize("command", ["sweep", "simulate", "coverage"])
def test_a_wrong_name_is_reported_before_anything_is_compiled(tmp_path, command):
    process = subprocess.run(
        [sys.executable, "-m", "explore", command, "typo.toml"],
        cwd=tmp_path,
        env={**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache"), "PYTHONPATH": os.pathsep.join(sys.path)},
        capture_output=True,
        text=True,
        timeout=300,
    )

    assert process.returncode == 2
    assert process.stderr == "error: typo.toml: no such file; `explore init` writes one to start from\n"
    assert not list(tmp_path.iterdir())


def test_a_failed_compilation_leaves_numba_and_the_garbage_collector_as_they_were():
    def fail():
        with quick_compilation():
            assert not gc.isenabled()
            assert "get_call_type" in vars(types.Function)
            raise TypeError

    with pytest.raises(TypeError):
        fail()

    assert gc.isenabled()
    assert "get_call_type" not in vars(types.Function)


def leave_out_lowering(monkeypatch):
    monkeypatch.setattr(compiler_passes, "_LEFT_OUT", {"NativeLowering"})


def fill_managers_otherwise(monkeypatch):
    monkeypatch.setattr(compiler_passes, "PassManager", lambda name: object())


def forget_keys_of_operators(monkeypatch):
    monkeypatch.setattr(compiler_passes, "_signatures", None)


def change_libraries(monkeypatch):
    monkeypatch.setattr(compiler_passes._Assembly, "_optimize_final_module", lambda self, mode: None)


@pytest.mark.parametrize(
    "change", [None, leave_out_lowering, fill_managers_otherwise, forget_keys_of_operators, change_libraries]
)
def test_numba_compiles_in_its_own_way_where_its_internals_changed(monkeypatch, change):
    monkeypatch.setattr(compiler_passes, "_works", None)
    half = compiler_passes.translated(lambda x: 0.5 * x, {"_nrt": False})

    @njit(pipeline_class=PlainCompiler, _nrt=False)
    def half_of_all(values):
        total = 0.0
        for k in range(len(values)):
            total += half(values[k])
        return total

    if change is not None:
        change(monkeypatch)
    with quick_compilation():
        assert half_of_all(np.array([1.0, 6.0])) == 3.5
        assert "get_call_type" in vars(types.Function)

    assert compiler_passes._works == (change is None)
    assert "get_call_type" not in vars(types.Function)


def test_functions_that_numba_compiles_in_its_own_way_call_subroutines_of_subroutines():
    half = compiler_passes.translated(lambda x: 0.5 * x, {"_nrt": False})
    quarter = compiler_passes.translated(lambda x: half(half(x)), {"_nrt": False})
    assert njit(lambda x: 2.0 * quarter(x))(8.0) == 4.0


#: A script that calls a long function from a function of each kind, with an array that is not read.
OF_BOTH_KINDS = f"""
import json, math, numpy
from numba import njit
from explore.base import compiler_passes
def total(unread, n):
    return {" + ".join(f"math.sin({k} * n)" for k in range(300))}
called = compiler_passes.translated(total, {{"_nrt": False}})
def twice(array, n):
    return called(array, n) + called(array, n + 1)
kinds = [njit(pipeline_class=compiler_passes.PlainCompiler, _nrt=False), njit]
print(json.dumps([[kind(twice)(numpy.zeros(3), 3) for kind in kinds], total(None, 3) + total(None, 4)]))
"""


def test_copies_of_a_function_in_callers_of_both_kinds_are_told_apart(tmp_path):
    """That of a function that Numba compiles in its own way takes all arguments, the other one those that are read."""
    sums, expected = report(tmp_path, OF_BOTH_KINDS)

    assert sums == pytest.approx([expected] * 2, rel=1e-12)


def with_a_changed_module(module):
    """A script that reports lookups in the cache after a change of a module of the package."""
    return f"""
import pathlib, explore
read = pathlib.Path.read_bytes
changed = pathlib.Path(explore.__file__).parent / "{module}"
assert changed.is_file()
pathlib.Path.read_bytes = lambda self: read(self) + (b"\\n" if self == changed else b"")
{REPORT}print(json.dumps(stats))
"""


def test_a_change_of_a_module_that_a_kernel_imports_is_noticed(first, tmp_path):
    """A function in the cache holds the code of those that it calls, wherever they stand."""
    cache = shutil.copytree(first[0], tmp_path / "cache")
    script = with_a_changed_module("base/lanes/elementary.py").replace(
        "(mechanism)", '(mechanism, metrics=["swing_angle"])'
    )
    lookups = report(cache, script)

    assert lookups == {"sample_moments": [0, 0], "close_all": [1, 0], "close": [0, 1], "fill": [0, 0]}


@pytest.mark.parametrize("module", ["cli/application.py", "mechanisms/gears/kernel.py"])
def test_a_change_elsewhere_compiles_nothing(first, module):
    lookups = report(first[0], with_a_changed_module(module))

    assert all((hits, misses) == (1, 0) for hits, misses in lookups.values()), lookups


PACKAGE = """
import importlib, json, sys
sys.path.insert(0, {folder!r})
kernel = importlib.import_module("third_party.kernel")
result = kernel.area(2.0)
print(json.dumps([result, kernel.area.stats.cache_hits.total()]))
"""


@pytest.mark.parametrize("statement", ["from .constants import FACTOR", "from third_party.constants import FACTOR"])
def test_a_change_of_a_constant_of_another_package_is_noticed(tmp_path, statement):
    package = tmp_path / "third_party"
    package.mkdir()
    (package / "__init__.py").touch()
    (package / "constants.py").write_text("FACTOR = 3.0\n")
    (package / "kernel.py").write_text(
        f"from explore.base.compiling import compiled\n{statement}\n"
        '@compiled("float64(float64)")\ndef area(x):\n    return FACTOR * x\n'
    )
    script = PACKAGE.format(folder=str(tmp_path))

    assert report(tmp_path, script) == [6.0, 0]
    assert report(tmp_path, script) == [6.0, 1]
    (package / "constants.py").write_text("FACTOR = 5.00\n")  # of another size, or Python may take the old one
    assert report(tmp_path, script) == [10.0, 0]


MOVED = """
import importlib, json, sys
sys.path.insert(0, {folder!r})
kernel, places = importlib.import_module("third_party.kernel"), importlib.import_module("third_party.{places}")
result = kernel.distance(places.Place(3.0, 4.0))
print(json.dumps([result, kernel.distance.stats.cache_hits.total()]))
"""


def test_a_function_is_compiled_anew_where_the_class_of_an_argument_has_moved(tmp_path):
    """The cache names the class, whose module the kernel need not import."""
    package = tmp_path / "third_party"
    package.mkdir()
    (package / "__init__.py").touch()
    (package / "points.py").write_text(
        "from typing import NamedTuple\nclass Place(NamedTuple):\n    x: float\n    y: float\n"
    )
    (package / "kernel.py").write_text(
        "import math\nfrom explore.base.compiling import compiled\n"
        "@compiled()\ndef distance(place):\n    return math.hypot(place.x, place.y)\n"
    )

    for expected in ([5.0, 0], [5.0, 1]):
        assert report(tmp_path, MOVED.format(folder=str(tmp_path), places="points")) == expected
    (package / "points.py").rename(package / "places.py")
    for expected in ([5.0, 0], [5.0, 1]):
        assert report(tmp_path, MOVED.format(folder=str(tmp_path), places="places")) == expected


def test_mechanisms_that_are_not_used_are_not_even_imported(first):
    script = """
import json, sys
import explore
from explore.mechanisms.registry import MECHANISMS
names = sorted(MECHANISMS)
explore.evaluate("crank-rocker", {"crank": 100.0, "coupler": 300.0, "rocker": 250.0, "ground": 350.0})
imported = [name for name in sys.modules if name.startswith("explore.mechanisms.rig")]
rig = MECHANISMS["test-rig"]
print(json.dumps([names, imported, [len(function.signatures) for function in (rig.close, rig.fill)]]))
"""
    assert report(first[0], script) == [sorted(MECHANISMS), [], [0, 0]]


FUNCTIONS = """
from numba import types
from explore.base.compiling import compiled, function_type
RULE = "float64(float64)"
APPLY = types.float64(function_type(RULE), types.float64)
@compiled(RULE)
def twice(x):
    return 2.0 * x
@compiled(APPLY)
def inner(function, x):
    return function(x)
@compiled(APPLY)
def outer(function, x):
    return inner(function, x)
@compiled("float64(float64, int64)")
def times(x, factor):
    return factor * x
@compiled(RULE)
def sixfold(x):
    return times(times(x, 2), 3)
"""


@pytest.fixture
def functions(tmp_path, monkeypatch):
    """The module of these functions, in a process that loads none of them from the cache."""
    (tmp_path / "compiled_for_another.py").write_text(FUNCTIONS)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "compiled_for_another", raising=False)
    return importlib.import_module("compiled_for_another")


def test_a_function_compiled_for_another_is_also_called_from_python(functions):
    """The compiled caller makes an overload of the inner function."""
    assert functions.outer(functions.twice, 1.5) == 3.0
    assert functions.inner(functions.twice, 2.5) == 5.0


def test_threads_that_compile_at_once_wait_for_each_other(functions):
    """As on the threads of a dask worker, which finds an empty cache."""
    with ThreadPoolExecutor(4) as pool:
        runs = [pool.submit(functions.outer, functions.twice, 1.5) for _ in range(4)]
    assert [run.result() for run in runs] == [3.0] * 4


def test_numbers_that_callers_write_out_make_no_versions(functions):
    assert functions.sixfold(1.5) == 9.0
    assert len(functions.times.signatures) == 1
