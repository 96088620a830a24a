"""Study texts that several tests change, and the sweep of one."""

import pytest

import explore


def crank_rockers(crank=100, coupler=1083.4236, rocker=541.7118, ground=691.7118, **others):
    """A study of crank-rockers: numbers, lists, entries as texts, pairs of min and max, or start, stop and num."""
    text = 'mechanism = "crank-rocker"\n[parameters]\n'
    for name, value in {"crank": crank, "coupler": coupler, "rocker": rocker, "ground": ground, **others}.items():
        form = {2: "{{ min = {}, max = {} }}", 3: "{{ start = {}, stop = {}, num = {} }}"}
        text += f"{name} = {form[len(value)].format(*value) if isinstance(value, tuple) else value}\n"
    return text


#: The smallest valid study: one design.
GOOD = crank_rockers(100, 1000, 500, 700)
#: Eight designs, some of which cannot turn.
FEW = crank_rockers([80, 100, 150, 160], ground=[691.7118, 720])
#: Two four-bars of a table.
TABLE = """mechanism = "linkage"
[linkage]
driver = "crank"
[linkage.frame]
O = [0, 0]
C = ["g", 0]
[linkage.links]
crank = { O = 0, A = "r" }
coupler = { A = 0, B = "b", P = [40, 20] }
rocker = { C = 0, B = "c" }
[linkage.sketch]
crank_angle = 0
B = [70, 60]
[parameters]
g = 100
r = [20, 30]
b = 90
c = 80
"""
#: Two slider-cranks that friction locks: at some crank angles, and at all of them.
LOCKED = """mechanism = "linkage"
[linkage]
driver = "crank"
[linkage.frame]
O = [0, 0]
[linkage.links]
crank = { O = 0, A = "r" }
rod = { A = 0, B = "l" }
[linkage.slots]
guide = { pin = "B", link = "frame", along = ["O", [1, 0]] }
[linkage.branch]
B = "far"
[linkage.loads]
opposing = { guide = 50 }
friction = { guide = "mu", A = { coefficient = 0.1, radius = 5 } }
[parameters]
r = 50
l = 60
mu = [0.9, 2.5]
"""
#: What may follow TABLE: a path for its point, and an angle at which the linkage lies.
TARGET = """ground_angle = 10
[target]
kind = "path"
point = "P"
points = [[40, 40], [50, 60], [20, 70]]
"""


def with_parameter(name, value):
    """GOOD with one parameter replaced or added, and the line it stands on."""
    lines = [line for line in GOOD.splitlines() if not line.startswith(name + " ")]
    return "\n".join([*lines, f"{name} = {value}"]) + "\n", len(lines) + 1


def box(rest):
    """A study of crank-rockers around the published optimum, drawn from a Sobol' sequence, with the rest of it."""
    return f'{crank_rockers(50, (50, 1000), (50, 500), (50, 1000))}[sampling]\nmethod = "sobol"\n{rest}'


def published_box(count):
    """So many designs around the published optimum, ranked by what was optimised."""
    return box(f"""\
count = {count:_}
seed = 1
[evaluate]
window = "drive"
drive = "slow"
metrics = ["mean_output_ratio", "cv"]
[constraints]
transmission_angle_min = {{ min = 30 }}
transmission_angle_max = {{ max = 150 }}
[rank]
metrics = ["cv", "mean_output_ratio:max"]
""")


def grid(rest, num=16):
    """A study of crank-rockers with `num` cranks, 9,450 designs for each, with the rest of it: 16 make three blocks."""
    return crank_rockers((60, 180, num), (900, 1300, 21), (450, 660, 15), (620, 830, 15), speed=[1, 2.5]) + rest


def sweep_text(folder, text, name="study", **options):
    """The results of the study of a text, written beside it."""
    (folder / f"{name}.toml").write_text(text, encoding="utf-8")
    return explore.sweep(explore.load_study(folder / f"{name}.toml"), folder / f"{name}.h5", **options)


def swept(text, name="study", give=lambda results: results):
    """A fixture of a module: what to give of the results of the study of a text, which are not to be changed."""

    @pytest.fixture(scope="module")
    def results(tmp_path_factory):
        return give(sweep_text(tmp_path_factory.mktemp(name), text, name))

    return results


def synthesize_text(folder, text, name="task", **options):
    """The results of the task of a text, written beside it."""
    (folder / f"{name}.toml").write_text(text, encoding="utf-8")
    return explore.synthesize(folder / f"{name}.toml", folder / f"{name}.h5", **options)
