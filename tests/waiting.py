"""Wait for an event: a slow machine fails no test."""

import time

#: Seconds after which what a test waits for counts as hung.
PATIENCE = 240


def wait_until(condition, pause=0.01):
    """Wait until a condition returns a true value, and return that."""
    end = time.monotonic() + PATIENCE
    while not (value := condition()):
        assert time.monotonic() < end, f"not true within {PATIENCE} s"
        time.sleep(pause)
    return value
