"""Messages about invalid sections."""

import pytest
from studies import GOOD


@pytest.mark.parametrize(
    ("section", "problem"),
    [
        ('method = "sobl"', "8: sampling.method: unknown method 'sobl'; did you mean 'sobol'?"),
        (
            'method = "quasi"',
            "8: sampling.method: unknown method 'quasi'; available: grid, sobol, latin-hypercube, random, table",
        ),
        (
            "count = 5",
            '8: sampling.count: has no effect with method = "grid"; remove it or set method = "sobol" or',
        ),
        ("seed = 5", '8: sampling.seed: has no effect with method = "grid"; '),
        ('file = "x.csv"', '8: sampling.file: needs method = "table", not "grid"; remove it or'),
        ('method = "table"', "7: sampling.file: is missing; name the table of designs, such as file ="),
        ('method = "table"\nfile = 3', "9: sampling.file: must be a string in quotes, got 3"),
        ('method = "table"\nfile = "x.csv"\ncount = 5', '10: sampling.count: has no effect with method = "table"; '),
        ('method = "table"\nfile = "x.csv"\nseed = 5', '10: sampling.seed: has no effect with method = "table"; '),
        ('method = "sobol"\ncount = 0', "9: sampling.count: must be at least 1, got 0"),
        ('method = "sobol"\ncount = 1.0', "9: sampling.count: must be a whole number without quotes, got 1.0"),
        ('method = "sobol"\ncount = 1073741825', "9: sampling.count: the Sobol' sequence has 30 bits"),
        ('method = "random"', "7: sampling.count: is missing; say how many"),
        (
            f'method = "random"\ncount = {2**63}',
            "9: sampling.count: designs are numbered in 64 bits, which allows at most 9223372036854775807 designs, got",
        ),
        (
            'method = "latin-hypercube"\ncount = 10000001',
            "9: sampling.count: a Latin hypercube is held in memory, which allows at most 10000000 designs, got 10",
        ),
        (f'method = "random"\ncount = 5\nseed = {2**63}', "10: sampling.seed: must be less than or equal to 92233720"),
        ('method = "sobol"\ncount = 5\nseed = -1', "10: sampling.seed: must be greater than or equal to 0, got -1"),
        ('method = "sobol"\ncount = 5\nfile = "x"', '10: sampling.file: needs method = "table", not "sobol"'),
        ('method = "sobol"\ncuont = 5', "9: sampling.cuont: unknown key; did you mean 'count'?"),
    ],
)
def test_bad_sampling(problems, section, problem):
    text = GOOD.replace("crank = 100", "crank = [100, 101]") + "[sampling]\n" + section + "\n"
    assert any(line.startswith(f"study.toml:{problem}") for line in problems(text))


@pytest.mark.parametrize(
    ("section", "problem"),
    [
        ('[evaluate]\nmetrics = ["cv",\n "foo"]', "9: evaluate.metrics: unknown metric 'foo'"),
        ("[evaluate]\nmetrics = []", "8: evaluate.metrics: the list is empty; leave it out"),
        ('[evaluate]\nmetrics = "cv"', "8: evaluate.metrics: must be a list, such as"),
        ("[evaluate]\nmetrics = [3]", "8: evaluate.metrics: must be a string in quotes, got 3"),
        ('[evaluate]\nwindow = "cylce"', "8: evaluate.window: unknown window 'cylce'; did you mean 'cycle'?"),
        ('[evaluate]\nwindow = "interval"', "8: evaluate.window: an interval needs crank angles"),
        ("[evaluate]\nwindow = { from = 9, to = 3 }", "8: evaluate.window: from = 9 must be below to = 3"),
        ("[evaluate]\nwindow = 5", "8: evaluate.window: unknown window 5"),
        ('[evaluate]\ndrive = "slwo"', "8: evaluate.drive: unknown drive 'slwo'; did you mean 'slow'?"),
        ("[evaluate]\ndrive = 3", "8: evaluate.drive: must be a string in quotes, got 3"),
        ("[evaluate]\ntolerance = 1e-15", "8: evaluate.tolerance: 1e-15 is outside 1e-13 to 0.0001"),
        ("[evaluate]\ntolerence = 1e-9", "8: evaluate.tolerence: unknown key; did you mean 'tolerance'?"),
        ("[constraints]\nswing_angle = 3", "8: constraints.swing_angle: at least one bound is needed"),
        ("[constraints.swing_angle]\nmni = 3", "8: constraints.swing_angle.mni: unknown key; did you mean 'min'?"),
        ("[constraints]\nswng_angle = { min = 1 }", "8: constraints.swng_angle: unknown metric 'swng_angle'"),
        ("[constraints]\ncv = { max = nan }", "8: constraints.cv.max: nan is not a finite number"),
        ('[rank]\nmetrics = ["foo"]', "8: rank.metrics: unknown metric 'foo'"),
        ('[rank]\nmetrics = ["speed:max"]', "8: rank.metrics: speed is not among the parameters, so it is the same"),
        ('[rank]\nmetrics = ["cv", "cv:max"]', "8: rank.metrics: cv is listed twice"),
        ("[rank]\nmetrics = []", "8: rank.metrics: the list is empty; leave it out"),
        (
            '[rank]\nmetrics = ["rocker_velocity_max"]',
            '8: rank.metrics: rocker_velocity_max is not computed; add "rocker_velocity_max" to the metrics',
        ),
        ("[rank]\nmetric = []", "8: rank.metric: unknown key; did you mean 'metrics'?"),
        ("[evalute]\nx = 1", "7: evalute: unknown key; did you mean 'evaluate'?"),
    ],
)
def test_bad_section(problems, section, problem):
    assert problems(GOOD + section + "\n")[0].startswith(f"study.toml:{problem}")


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        (
            GOOD.partition("\n")[2],
            'study.toml:1: mechanism: is missing; begin the file with mechanism = "crank-rocker"',
        ),
        ("", 'study.toml:1: mechanism: is missing; begin the file with mechanism = "crank-rocker"'),
        (GOOD.replace('"crank-rocker"', "3"), "study.toml:1: mechanism: must be a string in quotes, got 3"),
    ],
)
def test_bad_mechanism(problems, text, problem):
    assert problems(text) == [problem]


def test_sections_that_are_not_tables(problems):
    missing, *others = problems('mechanism = "crank-rocker"\nparameters = 5\nrank = []\n')
    assert missing.startswith("study.toml:2: parameters: missing crank, coupler, rocker, ground; ")
    assert others == [
        "study.toml:2: parameters: must be a table of keys and values, got 5",
        "study.toml:3: rank: must be a table of keys and values, got []",
    ]


def test_everything_at_once_in_the_order_of_the_file(problems):
    text = """\
# a comment with [brackets] and key = "value"
mechanism = "crank-rocker"
[parameters] # = { "
crank = [
    100,  # = [ {
    "15 cmm",
    -5,
]
coupler = { start = 900, stpo = 1100, num = 0 }
"rocker" = "no # comment = here"
speed.start = 1
speed.stop = "x = '1'"
speed.num = 'three'
grnd = 3
[sampling]
count = 5
[evaluate]
window = "dirve"
metrics = ["cv", "foo"]
[constraints.swing_angle]
min = nan
[rank]
metrics = ["cv:up"]
"""
    assert [problem.split(": ")[:2] for problem in problems(text)] == [
        ["study.toml:6", "parameters.crank"],
        ["study.toml:7", "parameters.crank"],
        ["study.toml:9", "parameters.coupler.stpo"],
        ["study.toml:10", "parameters.rocker"],
        ["study.toml:13", "parameters.speed.num"],
        ["study.toml:14", "parameters.grnd"],
        ["study.toml:16", "sampling.count"],
        ["study.toml:18", "evaluate.window"],
        ["study.toml:19", "evaluate.metrics"],
        ["study.toml:21", "constraints.swing_angle.min"],
        ["study.toml:23", "rank.metrics"],
    ]
