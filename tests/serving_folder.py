"""Serve a folder without a network until no job waits or runs: a process for the tests to kill."""

import sys
import time
from pathlib import Path

from explore.service.folder import State
from explore.service.plans import Limits
from explore.service.runner import Work
from explore.service.station import open_station

if __name__ == "__main__":
    with open_station(Path(sys.argv[1]), Limits(), Work(workers=1)) as station:
        while any(job.state in (State.queued, State.running) for job in station.jobs.in_order()):
            time.sleep(0.01)
