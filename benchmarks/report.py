"""The report: size of the page, seconds until it is ready, and milliseconds from a brush to what it draws.

Run with ``python benchmarks/report.py``; needs a browser, see tests/browser. Three studies are swept: a box of designs
of which a third can turn, with the columns of configs/optimum.toml and with all default columns; and a box of designs
that all turn, with all default columns. Medians of five pages.
"""

import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

BOX = """mechanism = "crank-rocker"
[parameters]
crank = 50
coupler = {{ min = {coupler}, max = {most} }}
rocker = {{ min = {rocker}, max = 500 }}
ground = {{ min = {ground}, max = {most} }}
[sampling]
method = "sobol"
count = {count}
{metrics}[constraints]
transmission_angle_min = {{ min = 30 }}
transmission_angle_max = {{ max = 150 }}
"""
WIDE = {"coupler": 50, "rocker": 50, "ground": 50, "most": 1000}
#: All designs of this box are crank-rockers: their Grashof margin is positive.
TURNING = {"coupler": 900, "rocker": 460, "ground": 900, "most": 930}
FEW = """[evaluate]
metrics = ["swing_angle", "time_ratio", "mean_output_ratio", "transmission_angle_min", "transmission_angle_max", "cv"]
"""
STUDIES = {"6 metrics": (WIDE, FEW), "all metrics": (WIDE, ""), "all metrics, all turn": (TURNING, "")}
PAGES = 5
#: Milliseconds from the pointer's move to the second frame after it, when the selection is drawn.
BRUSH = """([x, y]) => new Promise((done) => {
    const start = performance.now();
    document.elementFromPoint(x, y).dispatchEvent(
        new MouseEvent("mousemove", {clientX: x, clientY: y, bubbles: true, view: window}));
    requestAnimationFrame(() => requestAnimationFrame(() => done(performance.now() - start)));
})"""


def run_explore(folder: Path, *arguments: str) -> float:
    """Run a command; return its seconds."""
    start = time.perf_counter()
    subprocess.run([sys.executable, "-m", "explore", *arguments], cwd=folder, check=True, capture_output=True)
    return time.perf_counter() - start


def measure(browser, path: Path) -> tuple[float, float]:
    """Seconds until ready and milliseconds of a brush, the median of some moves."""
    page = browser.new_page(viewport={"width": 1400, "height": 900})
    page.goto(path.as_uri())
    page.wait_for_selector("html[data-ready]", state="attached", timeout=120_000)
    ready = float(page.evaluate("document.documentElement.dataset.ready")) / 1000.0
    box = page.locator("#scatter .brush .overlay").bounding_box()
    x, y = box["x"] + 0.1 * box["width"], box["y"] + 0.1 * box["height"]
    page.mouse.move(x, y)
    page.mouse.down()
    times = [
        page.evaluate(BRUSH, [x + step * box["width"], y + step * box["height"]])
        for step in (0.3, 0.35, 0.4, 0.45, 0.5, 0.55, 0.6)
    ]
    page.mouse.up()
    page.close()
    return ready, statistics.median(times)


def main() -> None:
    from playwright.sync_api import sync_playwright

    executable = os.environ.get("CHROMIUM") or shutil.which("chromium") or shutil.which("google-chrome")
    arguments = ["--no-sandbox"] if os.geteuid() == 0 else []
    print(f"{'designs':>9s}  {'study':22s}{'written s':>10s}{'MB':>7s}{'ready s':>9s}{'brush ms':>10s}")
    with tempfile.TemporaryDirectory() as name, sync_playwright() as driver:
        folder = Path(name)
        browser = driver.chromium.launch(executable_path=executable, args=arguments)
        for count in (10_000, 100_000, 1_000_000):
            for study, (box, metrics) in STUDIES.items():
                (folder / "study.toml").write_text(BOX.format(count=count, metrics=metrics, **box))
                run_explore(folder, "sweep", "study.toml", "--restart", "--quiet")
                seconds = run_explore(folder, "report", "results/study.h5")
                page = folder / "results/study-report.html"
                ready, brush = (
                    statistics.median(v) for v in zip(*(measure(browser, page) for _ in range(PAGES)), strict=True)
                )
                megabytes = page.stat().st_size / 1e6
                print(
                    f"{count:9,d}  {study:22s}{seconds:10.1f}{megabytes:7.1f}{ready:9.2f}{brush:10.0f}",
                    flush=True,
                )
                for file in (folder / "results").iterdir():
                    file.unlink()
        browser.close()


if __name__ == "__main__":
    main()
