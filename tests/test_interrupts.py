"""Signals that wait until processes have started."""

import os
import signal
import subprocess
import sys
import threading
from contextlib import nullcontext

import pytest

from explore.running.interrupts import interrupts_held


@pytest.fixture
def told():
    """The signals that the handlers of this process have been told."""
    numbers = []
    before = {
        number: signal.signal(number, lambda each, _: numbers.append(each))
        for number in (signal.SIGINT, signal.SIGTERM)
    }
    yield numbers
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_waits_until_it_is_let_through(told, number):
    handler = signal.getsignal(number)
    with interrupts_held() as release:
        for _ in range(3):
            os.kill(os.getpid(), number)
        assert told == []
    assert told == []
    release()
    assert told == [number]
    assert signal.getsignal(number) is handler
    assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, ())


def test_a_signal_is_told_first_where_the_body_fails(told):
    """With the handlers of before in place, which may change them."""
    seen = []
    signal.signal(signal.SIGINT, lambda *_: seen.append(signal.getsignal(signal.SIGTERM)))
    handler = signal.getsignal(signal.SIGTERM)

    def fail():
        os.kill(os.getpid(), signal.SIGINT)
        raise RuntimeError("no node started")

    with pytest.raises(RuntimeError, match="no node started"), interrupts_held():
        fail()
    assert seen == [handler]


def test_without_a_signal_nothing_is_let_through(told):
    with interrupts_held() as release:
        pass
    release()
    assert told == []


def test_processes_that_start_meanwhile_do_not_get_ctrl_c(told):
    """The mask of a process that another thread starts."""
    program = "import signal; print(signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, ()))"
    out = []

    def start():
        out.append(subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout)

    for context in (interrupts_held(), nullcontext()):
        with context:
            thread = threading.Thread(target=start)
            thread.start()
        thread.join()
    assert out == ["True\n", "False\n"]


def test_off_the_main_thread_nothing_is_held(told):
    def hold():
        with interrupts_held():
            signal.raise_signal(signal.SIGTERM)

    thread = threading.Thread(target=hold)
    thread.start()
    thread.join()
    assert told == [signal.SIGTERM]
