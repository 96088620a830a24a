"""Neither the time nor the memory of `BlocksInFlight` grows with the number of blocks."""

import subprocess
import sys

import pytest

_PROGRAM = """
import resource, sys, time
from distributed import Client
from explore.running.in_flight import BlocksInFlight

def resident():
    pages = int(open("/proc/self/statm").read().split()[1])
    return pages * resource.getpagesize() / 1e6

if __name__ == "__main__":
    count, results = int(sys.argv[1]), []
    with Client(processes=False, n_workers=1, threads_per_worker=2, dashboard_address="127.0.0.1:0") as client:
        submit = lambda number, _: client.submit(abs, number, pure=False, retries=0)
        run = lambda blocks: BlocksInFlight(
            client, submit, lambda number, result: results.append(number == result), print, lambda *_, **__: None
        ).run(range(blocks))
        run(300)  # imports and caches
        results.clear()
        before, start, cpu_start = resident(), time.monotonic(), time.process_time()
        run(count)
        seconds, window = time.monotonic() - start, (time.process_time() - cpu_start) / count
        growth, cpu_start = resident() - before, time.process_time()
        for number in range(300):
            client.submit(abs, number, pure=False, retries=0).result()
        bare = (time.process_time() - cpu_start) / 300
        print(growth, seconds / count * 1e3, window * 1e3, bare * 1e3)
    assert len(results) == count and all(results)
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
    # Several under way save waiting: three quarters on a free machine; beside twenty busy processes they were equal.
    assert cpu < 1.5 * bare
