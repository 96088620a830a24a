"""A process that runs `explore` on results files that may crash HDF5: a line of JSON in, a line of JSON out."""

import json
import os
import resource
import select
import subprocess
import sys
from pathlib import Path

from waiting import PATIENCE

#: Address space of a worker, bytes: its packages take about 1 GB of it, a results file here some kB.
MEMORY = 3 << 30


class Worker:
    """The worker process; it is started on the first `run` and again after a crash."""

    def __init__(self) -> None:
        self._process = None

    def run(self, *commands: list[str]) -> list[dict]:
        """Exit code, stdout and stderr of each command; AssertionError if the process dies or hangs."""
        if self._process is None:
            self._start()
        self._process.stdin.write(json.dumps(commands) + "\n")
        self._process.stdin.flush()
        if not select.select([self._process.stdout], [], [], PATIENCE * len(commands))[0]:
            self.close()
            raise AssertionError(f"still not done: {commands}")
        answer = self._process.stdout.readline()
        if not answer:
            code = self._process.wait()
            self.close()
            raise AssertionError(f"the process died with exit code {code}: {commands}")
        return json.loads(answer)

    def _start(self) -> None:
        environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path)), "NO_COLOR": "1"}
        self._process = subprocess.Popen(
            [sys.executable, __file__], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment
        )

    def close(self) -> None:
        """End the process."""
        if self._process is not None:
            self._process.kill()
            self._process.communicate()
            self._process = None


def serve() -> None:
    """Answer until stdin ends."""
    from command_line import call
    from doors import knock

    from explore.results.store.open_results import open_results

    answers = sys.stdout
    for line in sys.stdin:
        replies = []
        for command, *arguments in json.loads(line):
            if command == "damaged blocks":
                replies.append({"damaged": open_results(arguments[0]).verify()})
                continue
            if command == "door":
                replies.append({"found": knock(Path(arguments[0]), arguments[1])})
                continue
            code, out, err = call(command, *arguments)
            replies.append({"code": code, "out": out, "err": err})
        answers.write(json.dumps(replies) + "\n")
        answers.flush()


if __name__ == "__main__":
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    os.environ["OMP_NUM_THREADS"] = os.environ["OPENBLAS_NUM_THREADS"] = "1"
    serve()
