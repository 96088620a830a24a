"""Neither the time nor the memory of `BlocksInFlight` grows with the number of blocks."""

from __future__ import annotations

import subprocess
import sys

import pytest

_PROGRAM = """
import resource, sys, time
from explore.sweeping.clusters import local_cluster
from explore.sweeping.in_flight import BlocksInFlight

def resident():
    pages = int(open("/proc/self/statm").read().split()[1])
    return pages * resource.getpagesize() / 1e6

if __name__ == "__main__":
    count, taken = int(sys.argv[1]), []
    with local_cluster(2, processes=False) as client:
        submit = lambda number, _: client.submit(abs, number, pure=False, retries=0)
        run = lambda blocks: BlocksInFlight(
            client, submit, lambda number, result: taken.append(number == result), print, lambda *_, **__: None
        ).run(range(blocks))
        run(300)  # imports and caches
        taken.clear()
        before, begun, used = resident(), time.monotonic(), time.process_time()
        run(count)
        seconds, window = time.monotonic() - begun, (time.process_time() - used) / count
        grown, used = resident() - before, time.process_time()
        for number in range(300):
            client.submit(abs, number, pure=False, retries=0).result()
        bare = (time.process_time() - used) / 300
        print(grown, seconds / count * 1e3, window * 1e3, bare * 1e3)
    assert len(taken) == count and all(taken)
"""


@pytest.mark.parametrize(("blocks", "megabytes"), [(2_000, 30), pytest.param(20_000, 150, marks=pytest.mark.slow)])
def test_blocks_in_flight_are_bounded_in_memory_and_fast(tmp_path, report, blocks, megabytes):
    program = tmp_path / "program.py"
    program.write_text(_PROGRAM)
    output = subprocess.run(
        [sys.executable, "-W", "error", str(program), str(blocks)],
        check=True,
        capture_output=True,
        text=True,
        timeout=300,
    ).stdout
    growth, wall, cpu, bare = map(float, output.split())
    report(
        f"{blocks:,} blocks of nothing: {growth:+.1f} MB, {wall:.2f} ms a block, {cpu:.2f} ms of CPU; "
        f"{bare:.2f} ms for a bare task of dask"
    )
    assert growth < megabytes
    assert cpu < bare  # seconds depend on who else is at work, the ratio does not: several under way save waiting
