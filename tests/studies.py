"""Study texts that several tests change."""

#: The least that loads: one design.
GOOD = """\
mechanism = "crank-rocker"
[parameters]
crank = 100
coupler = 1000
rocker = 500
ground = 700
"""
