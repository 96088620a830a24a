"""`python sabotage.py PLAN sweep …`: the command line, with blocks that are recorded, slow, or deadly.

PLAN is JSON: `record` names the file that notes every execution, `seconds` is how long a block takes at least (only
until the file named by `until` exists, if there is one), `poison` says by block number what happens there, `silence`
after how many seconds a process is called silent. The function below travels to the workers by value, because it is of
``__main__``; so it works on any cluster.
"""

import faulthandler
import functools
import json
import signal
import sys


def evaluate_by_plan(plan, request, space, number, *others):
    """Evaluate a block as the plan says."""
    import os
    import signal
    import time
    from pathlib import Path

    from explore.running.blocks import evaluate_block

    with Path(plan["record"]).open("a") as stream:
        stream.write(f"{number} {os.getpid()} {time.monotonic()}\n")
    end = time.monotonic() + plan.get("seconds", 0)
    while time.monotonic() < end and not ("until" in plan and Path(plan["until"]).exists()):
        time.sleep(min(0.02, max(0.0, end - time.monotonic())))
    poison = plan.get("poison", {}).get(str(number))
    if poison == "raise":
        raise ZeroDivisionError("poison")
    if poison == "exit":
        os._exit(1)
    if poison == "crash":
        os.kill(os.getpid(), signal.SIGSEGV)
    return evaluate_block(request, space, number, *others)


def main():
    """Run the command line on sabotaged blocks; a signal prints the stack."""
    faulthandler.register(signal.SIGUSR1)
    plan = json.loads(sys.argv.pop(1))
    from explore.cli import main as command_line
    from explore.running import clusters, runs, watch

    if "silence" in plan:
        watch.SILENCE = clusters.CONNECT_TIMEOUT = plan["silence"]
    runs.evaluate_block = functools.partial(evaluate_by_plan, plan)
    command_line()


if __name__ == "__main__":
    main()
