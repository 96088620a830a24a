"""Compile what most tests need, in one process: each mechanism with all its statistics over all its windows."""

from contextlib import suppress

from explore.mechanisms.registry import MECHANISMS
from explore.testing import check_mechanism

for mechanism in MECHANISMS.values():
    with suppress(AssertionError):  # tests say what is wrong
        check_mechanism(mechanism, designs=6)
