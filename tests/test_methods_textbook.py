"""The textbook formula loses digits towards the change point; the closed form does not."""

import numpy as np
import pytest
from test_methods import differences, exact, turn

from explore.methods.closed_form import ClosedForm
from explore.methods.contract import Level, Outcome
from explore.methods.textbook import TextbookArccos


@pytest.mark.parametrize(
    ("exponent", "at_least", "at_most"),
    [(10, 1e-13, 2e-11), (20, 1e-10, 2e-8), (30, 1e-7, 2e-5)],
)
def test_digits_are_lost_towards_the_change_point(exponent, at_least, at_most):
    """Velocities lose in proportion to 1 / margin: measured 1.5e-12, 9.1e-9, 8.9e-6, the reference has 60 digits."""
    # exact in binary, so that the margin is what it says
    task = turn([150.0 - 2.0**-exponent, 1083.5, 541.75, 691.75], level=Level.VELOCITIES)
    reference = exact(task)
    _, lost = differences(TextbookArccos().solve(task), reference)
    assert at_least < lost < at_most
    assert max(differences(ClosedForm().solve(task), reference)) < 1e-15


def test_arccos_out_of_range_is_told():
    """The crank of 200 is blocked at 0; the formula alone gives NaN there and says so, at the other angles numbers."""
    motion = TextbookArccos().solve(turn([200.0, 1083.4236, 541.7118, 691.7118]))
    assert motion.outcome.tolist() == [Outcome.NOT_FINITE]
    gaps = np.isnan(motion.signals[0, 0])
    assert 0 < gaps.sum() < 73
