"""What dask's scheduler for threads costs: for each block of a sweep, and once, to import.

``python benchmarks/threads.py``
"""

import subprocess
import sys
import time

from explore.running.threads import BlocksOnThreads, LocalThreads
from explore.studies.designs.spaces import BLOCK_SIZE

N_BLOCKS = 5_000
IMPORT = "import time, numpy, pandas; s = time.process_time(); import dask.local; print(time.process_time() - s)"


def main() -> None:
    """Print CPU times, each the least of five."""
    imports = [float(subprocess.run([sys.executable, "-c", IMPORT], capture_output=True).stdout) for _ in range(5)]
    print(f"import of dask.local       {min(imports):6.3f} s")
    times = []
    for _ in range(5):
        start = time.process_time()
        BlocksOnThreads(LocalThreads(2), abs, _ignore, _ignore, _ignore).run(range(N_BLOCKS))
        times.append((time.process_time() - start) / N_BLOCKS)
    print(f"a block that does nothing  {min(times) * 1e6:6.1f} us, {min(times) / BLOCK_SIZE * 1e9:.2f} ns a design")


def _ignore(*_: object, **__: object) -> None:
    pass


if __name__ == "__main__":
    main()
