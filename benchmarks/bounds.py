"""Error bounds beside true errors, by family, part and tolerance.

``python benchmarks/bounds.py [--tolerance 1e-9]``; about half a minute. Over the designs of
tests/reference/families.npz, each statistic requested alone: how many there are, how many err by more than their bound,
the largest ratio of error to bound and where, how many miss the tolerance, how many of all miss it needlessly because
the true error is below, and the median ratio of bound to error. The parts are moments and extremes over the
mechanism's own windows, and all statistics over explicit intervals. tests/test_campaign_families.py states the limits.
"""

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from bounds import PARTS, References, measure

TOLERANCES = (1e-6, 1e-9, 1e-12)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--tolerance", type=float, action="append")
    references = References()
    print(f"{'':44s}    rows   above     worst   missed needless    median  worst")
    for tolerance in parser.parse_args().tolerance or TOLERANCES:
        bounds = measure(references, tolerance)
        for number, family in enumerate((*references.families, "all")):
            for part in (*PARTS, None):
                chosen = (None if family == "all" else number, part)
                numbers = "{rows:8d}{above:8d}{worst:10.2e}{missed:9.2%}{needless:9.2%}{median:10.2e}".format(
                    **bounds.figures(*chosen)
                )
                print(f"{tolerance:.0e}  {family:26s}{part or 'all':12s}{numbers}  {bounds.worst(*chosen)}")


if __name__ == "__main__":
    main()
