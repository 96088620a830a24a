"""Columns of the arrays that tell the compiled loop what to compute."""

# Columns of the statistics of one window and row; ROOT_MEAN and ROOT_POWER_MEAN are means of powers of the root of a
# row that holds squares. These and the three that follow are integrals between places of their own.
(
    MEAN, VARIANCE, MINIMUM, MAXIMUM, ROOT_MEAN, ROOT_POWER_MEAN, FLUCTUATION, LAGGED_FLUCTUATION, LAGGED_MAX, BOUND,
) = range(10)  # fmt: skip
N_STATISTICS = 10
# Columns of a window's specification: kind; rows of the constants that hold its ends; 1 behind clutches, the row of the
# number of mechanisms, the signal and its derivative, and the bits to fill them.
KIND, START, STOP, CLUTCH, PHASES, RATE, RATE_DERIVATIVE, RATE_NEEDS = range(8)
