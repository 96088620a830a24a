"""Milliseconds of one step of a brush in the results browser, over HTTP, and of the index that it needs once.

Run with ``python benchmarks/browse.py [folder] [designs]``: 10^7 designs by default, which take 2 GB in the folder for
some minutes and are deleted at the end. The server sweeps the study and makes the index. A step is what the page asks
for when a brush moves: histograms of eight columns and a density of 160 x 120 bins of two of them, each with three
conditions whose limits are drawn at random. CPU time is that of the server's process, in steps of 10 ms; other users of
the machine disturb it less.
"""

import json
import os
import random
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
import urllib.parse
import urllib.request
from collections.abc import Callable
from pathlib import Path
from typing import Any

STUDY = """mechanism = "crank-rocker"
[parameters]
crank = {{ min = 60, max = 140 }}
coupler = {{ min = 900, max = 1000 }}
rocker = {{ min = 500, max = 600 }}
ground = {{ min = 700, max = 800 }}
[sampling]
method = "sobol"
count = {count}
[evaluate]
metrics = ["swing_angle", "time_ratio", "transmission_angle_min", "cv"]
"""
COLUMNS = ["crank", "coupler", "rocker", "ground", "swing_angle", "time_ratio", "transmission_angle_min", "cv"]
AXES = [("cv", "swing_angle"), ("crank", "time_ratio"), ("transmission_angle_min", "cv")]
_STEPS = 60


def main(folder: Path, count: int) -> None:
    command = [sys.executable, "-m", "explore", "serve", str(folder), "--port", "0"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    try:
        address = process.stdout.readline().split("open ")[1].split("/#")[0]
        get = client(address, (folder / "token").read_text().strip())
        get("/api/studies", {"name": "large", "study": STUDY.format(count=count)})
        while get("/api/jobs/large")["state"] != "done":
            time.sleep(1)
        make_index(get, process.pid, folder)
        brush(get, process.pid)
    finally:
        process.terminate()
        process.wait()


def client(address: str, token: str) -> Callable[..., Any]:
    """Asks the server: with a body by POST."""

    def ask(path: str, body: object = None) -> Any:
        data = None if body is None else json.dumps(body).encode()
        headers = {"Authorization": f"Bearer {token}", "Content-Type": "application/json"}
        with urllib.request.urlopen(urllib.request.Request(address + path, data, headers)) as answer:
            return json.loads(answer.read())

    return ask


def make_index(get: Callable[..., Any], pid: int, folder: Path) -> None:
    start, start_cpu = time.monotonic(), cpu_seconds(pid)
    get("/api/results/large/index?build=true")
    while (state := get("/api/results/large/index"))["state"] != "ready":
        time.sleep(0.1)
    seconds, cpu = time.monotonic() - start, cpu_seconds(pid) - start_cpu
    size = sum(file.stat().st_size for file in (folder / "index" / "large").iterdir())
    results = (folder / "results" / "large.h5").stat().st_size
    print(f"index of {state['designs']:,} designs: {seconds:.1f} s, {cpu:.1f} s CPU, {size / 1e9:.2f} GB "
          f"beside results of {results / 1e9:.2f} GB")  # fmt: skip


def brush(get: Callable[..., Any], pid: int) -> None:
    ends = {column["name"]: column for column in get("/api/results/large/browsing")["columns"]}
    generator = random.Random(1)
    wall, cpu, shares = [], [], []
    for step in range(_STEPS + 3):
        where = [draw_condition(ends[name], generator) for name in generator.sample(COLUMNS, 3)]
        x, y = AXES[step % len(AXES)]
        start, start_cpu = time.monotonic(), cpu_seconds(pid)
        shown = get("/api/results/large/histograms?" + query(columns=",".join(COLUMNS), where=where))
        get("/api/results/large/density?" + query(x=x, y=y, where=where))
        if step >= 3:  # the first ones compile
            wall.append(1000 * (time.monotonic() - start))
            cpu.append(1000 * (cpu_seconds(pid) - start_cpu))
            shares.append(shown["selected"] / shown["designs"])
    print(f"{_STEPS} steps, {min(shares):.1%} to {max(shares):.1%} of the designs selected")
    for name, values in (("wall", wall), ("CPU of the server", cpu)):
        p95 = statistics.quantiles(values, n=20)[-1]
        print(f"{name}: median {statistics.median(values):.0f} ms, p95 {p95:.0f} ms, longest {max(values):.0f} ms")


def draw_condition(column: dict[str, Any], generator: random.Random) -> str:
    low, high = sorted(generator.uniform(column["low"], column["high"]) for _ in range(2))
    return generator.choice([f"{low} < {column['name']} < {high}", f"{column['name']} > {low}"])


def query(**values: object) -> str:
    return urllib.parse.urlencode(values, doseq=True)


def cpu_seconds(pid: int) -> float:
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


if __name__ == "__main__":
    place = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(tempfile.gettempdir())
    served = Path(tempfile.mkdtemp(prefix="browse-", dir=place))
    try:
        main(served, int(float(sys.argv[2])) if len(sys.argv) > 2 else 2**23 + 2**21)
    finally:
        shutil.rmtree(served)
