"""A study and a task whose results can be refined, found within a second."""

from explore.synthesis.tasks.task_files import task_starter

#: 1024 designs with two objectives and ranges to refine.
BASE = """mechanism = "crank-rocker"
[parameters]
crank = { start = 100, stop = 140, num = 32 }
coupler = { start = 1000, stop = 1100, num = 32 }
rocker = 541.7118
ground = 691.7118
[rank]
metrics = ["cv", "swing_angle:max"]
"""
#: Linkages in closed form, seven with the best of each family: found within a second.
TASK = task_starter("dead-positions").replace("count = 20", "count = 6")
