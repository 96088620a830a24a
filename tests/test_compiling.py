"""The compiled kernels: vectorised, found in the cache by a second process, announced when they are compiled."""

import json
import os
import platform
import subprocess
import sys

import pytest

REPORT = """
import json
from explore import sampling
from explore.mechanisms.registry import MECHANISMS
functions = {"sample": sampling.sample}
for name, mechanism in MECHANISMS.items():
    functions |= {f"{name} {part}": getattr(mechanism, part) for part in ("closed_form", "pieces", "fill")}
stats = {name: [f.stats.cache_hits.total(), f.stats.cache_misses.total()] for name, f in functions.items()}
"""


def report(cache, extra):
    done = subprocess.run(
        [sys.executable, "-c", REPORT + extra],
        env={**os.environ, "NUMBA_CACHE_DIR": str(cache)},
        capture_output=True,
        text=True,
        check=True,
        timeout=300,
    )
    return json.loads(done.stdout)


@pytest.fixture(scope="module")
def cache(tmp_path_factory):
    return tmp_path_factory.mktemp("numba")


def test_a_second_process_compiles_nothing(cache):
    first = report(cache, "print(json.dumps(stats))")
    second = report(cache, "print(json.dumps(stats))")

    assert all(misses == 1 for _, misses in first.values()), first
    assert all((hits, misses) == (1, 0) for hits, misses in second.values()), second


@pytest.mark.skipif(platform.machine() != "x86_64", reason="reads x86-64 assembly")
def test_the_node_loops_are_vectorised(tmp_path):
    listing = "{name: ''.join(getattr(four_bar, name).inspect_asm().values()) for name in ('fill', '_fill_angles')}"
    assembly = report(tmp_path, f"from explore.mechanisms import four_bar\nprint(json.dumps({listing}))")

    # packed square roots and divisions of doubles, not only the scalar ones of the loop's remainder
    for code in assembly.values():
        assert "sqrtpd" in code
        assert "divpd" in code


def test_the_first_compile_is_announced_and_the_next_start_is_silent(tmp_path):
    (tmp_path / "one.toml").write_text(
        'mechanism = "crank-rocker"\n[parameters]\ncrank = 100\ncoupler = 1083.5\nrocker = 541.5\nground = 691.5\n'
    )
    said = [
        subprocess.run(
            [sys.executable, "-c", "from explore.cli import main; main()", "sweep", "one.toml", "--restart"],
            cwd=tmp_path,
            env={**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache")},
            capture_output=True,
            text=True,
            check=True,
            timeout=300,
        ).stderr
        for _ in range(2)
    ]

    assert "preparing the compiled kernels" in said[0]
    assert "preparing" not in said[1]
