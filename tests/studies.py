"""Study texts that several tests change."""

#: The smallest valid study: one design.
GOOD = """\
mechanism = "crank-rocker"
[parameters]
crank = 100
coupler = 1000
rocker = 500
ground = 700
"""

#: Eight designs, some of which cannot turn.
FEW = """mechanism = "crank-rocker"
[parameters]
crank = [80, 100, 150, 160]
coupler = 1083.4236
rocker = 541.7118
ground = [691.7118, 720]
"""
