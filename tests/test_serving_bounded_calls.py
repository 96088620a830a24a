"""Calls with a time limit, in processes that end with their caller."""

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest
from waiting import wait_until

from explore.base.errors import ConfigError, RequestError
from explore.service.bounded_calls import BoundedCalls
from explore.studies.config.study_file import load_study


@pytest.fixture
def calls():
    made = BoundedCalls(seconds=30.0)
    yield made
    made.close()


def test_values_and_errors_are_those_of_the_function_in_one_process(calls, tmp_path):
    process = calls.call("it", os.getpid)
    assert process != os.getpid()
    (tmp_path / "wrong.toml").write_text('mechanism = "crank-rocker"\nwrong = 1\n')
    with pytest.raises(ConfigError) as caught:
        calls.call("it", load_study, tmp_path / "wrong.toml")
    assert any("wrong: unknown key" in problem for problem in caught.value.problems)
    assert calls.call("it", os.getpid) == process


def test_a_call_that_takes_too_long_is_refused_and_its_process_killed(calls):
    process = calls.call("the ranking", os.getpid)
    calls._seconds = 0.2
    start = time.monotonic()
    with pytest.raises(RequestError, match="the ranking took longer than 0 s, this server's limit; ask for less, or"):
        calls.call("the ranking", time.sleep, 600)
    assert time.monotonic() - start < 60
    assert not Path(f"/proc/{process}").exists()
    calls._seconds = 30.0
    assert calls.call("the ranking", os.getpid) != process


def test_a_process_that_was_killed_is_told_in_words_and_replaced(calls):
    with pytest.raises(RequestError, match="the process of the ranking was killed; is memory short"):
        calls.call("the ranking", os._exit, 1)
    assert calls.call("the ranking", abs, -1) == 1


def test_a_call_ends_when_its_caller_is_killed(tmp_path):
    script = tmp_path / "caller.py"
    script.write_text(
        "import os, threading, time\n"
        "from explore.service.bounded_calls import BoundedCalls\n"
        "if __name__ == '__main__':\n"
        "    calls = BoundedCalls(600.0)\n"
        "    print(calls.call('it', os.getpid), flush=True)\n"
        "    threading.Thread(target=calls.call, args=('it', time.sleep, 600), daemon=True).start()\n"
        "    time.sleep(600)\n"
    )
    with subprocess.Popen([sys.executable, script], stdout=subprocess.PIPE, text=True) as caller:
        process = int(caller.stdout.readline())
        caller.kill()
    status = Path(f"/proc/{process}/status")
    wait_until(lambda: not status.exists() or "(zombie)" in status.read_text())
