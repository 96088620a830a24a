"""Tables of linkages: what is read from them, and each mistake with its file, line and key."""

import math
import pickle
import tomllib
from pathlib import Path

import pytest
from linkage_cases import REFERENCE

from explore.base.errors import ConfigError
from explore.mechanisms.linkages.steps import find_steps
from explore.studies.config.linkage import Linkage, load_linkage
from explore.studies.linkages.branch import two_sided, words_of
from explore.studies.linkages.coordinates import read_place, value_of

TABLES = {case["name"]: case["table"] for case in REFERENCE["cases"]}
#: Those that no chain of dyads solves.
GROUPS = ("scotch-yoke", "stephenson-2")
DYADS = [name for name in TABLES if name not in GROUPS]

SHAPER = """\
[linkage]
driver = "crank"
output = "ram"

[linkage.frame]
O = [0, 0]
C = [0, "-height"]

[linkage.links]
crank = { O = 0, A = "r" }
lever = { C = 0, D = "l" }
link = { D = 0, S = "k", P = { radius = "p", angle = "turn" } }

[linkage.slots]
block = { pin = "A", link = "lever", along = ["C", "D"] }
ram = { pin = "S", link = "frame", along = [[0, "rise"], [1, "rise"]] }

[linkage.branch]
S = "far"

[parameters]
r = 50
height = 120
l = 260
k = 80
rise = 145
p = 40
turn = 30
"""

FOUR_BAR = """\
[linkage]
driver = "crank"

[linkage.frame]
O = [0, 0]
C = [100, 0]

[linkage.links]
crank = { O = 0, A = "r" }
rod = { A = 0, B = 90 }
rocker = { C = 0, B = 70 }

[linkage.branch]
B = "left of A C"

[parameters]
r = 30
"""


def problems_of(tmp_path, text):
    """The problems of a file, without its name."""
    file = tmp_path / "table.toml"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError) as error:
        load_linkage(file)
    assert all(line.startswith(f"{file}:") for line in error.value.problems)
    return [line.removeprefix(f"{file}:") for line in error.value.problems]


def test_the_shaper_is_read(tmp_path):
    (tmp_path / "shaper.toml").write_text(SHAPER)
    table = load_linkage(tmp_path / "shaper.toml").table
    assert (table.driver, table.output, table.signs) == ("crank", "ram", (("block", 1), ("S", 1)))
    units = {parameter.name: parameter.unit for parameter in table.parameters}
    assert units == {"height": "mm", "r": "mm", "l": "mm", "k": "mm", "p": "mm", "turn": "deg", "rise": "mm"}


def test_the_angle_of_a_place_has_a_unit_of_angles():
    """One of 30 mm was 30 deg, and one in deg or rad was refused."""
    problems = []
    for angle in (30, "30 deg", f"{math.pi / 6!r} rad"):
        place = read_place({"radius": "2 mm", "angle": angle}, ("P",), problems)
        assert [value_of(each, {}) for each in place] == pytest.approx([3**0.5, 1.0], rel=1e-15)
    assert not problems
    read_place({"radius": 2, "angle": "30 mm"}, ("P",), problems)
    assert [key for key, _ in problems] == [("P", "angle")]


MISTAKES = tomllib.loads((Path(__file__).parent / "linkage_mistakes.toml").read_text())["mistakes"]


@pytest.mark.parametrize("mistake", MISTAKES, ids=lambda mistake: mistake["lines"][0])
def test_every_mistake_has_its_line_and_key(tmp_path, mistake):
    assert mistake["old"] in SHAPER
    assert problems_of(tmp_path, SHAPER.replace(mistake["old"], mistake["new"], 1)) == mistake["lines"]


def test_mobility_other_than_one(tmp_path):
    five_bar = FOUR_BAR.replace("rod = { A = 0, B = 90 }", "rod = { A = 0, D = 90 }\nrod_2 = { D = 0, B = 60 }")
    (line,) = problems_of(tmp_path, five_bar)
    assert line.startswith("10: linkage.links.rod: rod, rod_2 and rocker move freely: 1 joint equation too few; ")
    twice = FOUR_BAR.replace("rocker = {", "third = { C = [0, 5], A = 30, B = 9 }\nrocker = {")
    (line,) = problems_of(tmp_path, twice)
    assert line.endswith(": third holds what the other joints hold already; leave it out")


@pytest.mark.parametrize("frame", ["O = [0, 0]", "O = [0, 0]\nC = [100, 0]\nA = [3, 4]"])
def test_the_driver_turns_about_one_point_of_the_frame(tmp_path, frame):
    lines = problems_of(tmp_path, FOUR_BAR.replace("O = [0, 0]\nC = [100, 0]", frame))
    assert len(lines) == 1


def test_a_file_without_a_linkage(tmp_path):
    assert problems_of(tmp_path, "driver = 3\n") == [
        "1: linkage: is missing; describe the linkage in the section [linkage]"
    ]


@pytest.mark.parametrize(
    ("part", "line"),
    [
        ("\n".join(f"P{n} = [0, 0]" for n in range(70)), "has 74 points; at most 60 are possible"),
        ("\n[linkage.parameters]\n" + "\n".join(f"p{n} = {{}}" for n in range(101)), "has 101 parameters; at most 100"),
        ("\n[linkage.slots]\n" + "\n".join(f"p{n} = {{}}" for n in range(41)), "has 41 slots; at most 40 are possible"),
    ],
)
def test_tables_have_a_largest_size(tmp_path, part, line):
    (found,) = problems_of(tmp_path, FOUR_BAR.replace("C = [100, 0]", f"C = [100, 0]\n{part}\n"))
    assert line in found


def test_expressions_have_a_largest_size(tmp_path):
    (found,) = problems_of(tmp_path, FOUR_BAR.replace('"r"', f'"{"+".join(["r"] * 501)}"'))
    assert found == "9: linkage.links.crank.A: has 1,001 characters, but a formula has at most 1,000; split it"
    points = ", ".join(f'P{n} = ["{"+".join(["r"] * 400)}", "r"]' for n in range(20))
    (found,) = problems_of(tmp_path, FOUR_BAR.replace("B = 90", f"B = 90, {points}"))
    assert found.endswith("numbers, names and operators in its coordinates; at most 1,000 are possible")


@pytest.mark.parametrize("name", DYADS)
def test_a_sketch_and_the_words_give_the_same_table(name):
    sketched = Linkage(tomllib.loads(TABLES[name]))
    steps = two_sided(find_steps(sketched.table))
    assert [name for name, _ in sketched.table.signs] == list(steps)
    sections = tomllib.loads(TABLES[name])
    del sections["linkage"]["sketch"]
    sections["linkage"]["branch"] = {name: words_of(steps[name])[sign < 0] for name, sign in sketched.table.signs}
    assert Linkage(sections) == sketched


@pytest.mark.parametrize("name", DYADS)
def test_the_content_of_a_linkage_describes_it(name):
    linkage = Linkage(tomllib.loads(TABLES[name]))
    assert Linkage(linkage.content) == linkage == Linkage(tomllib.loads(linkage.to_toml()))
    assert Linkage(linkage.content).content == linkage.content
    assert pickle.loads(pickle.dumps(linkage)) == linkage
    assert hash(pickle.loads(pickle.dumps(linkage))) == hash(linkage)


def test_a_sketch_near_the_border_between_two_assemblies(tmp_path):
    near = FOUR_BAR.replace("90", "60").replace("70", "40").replace(
        '[linkage.branch]\nB = "left of A C"', "[linkage.sketch]\ncrank_angle = 40\nB = [66, 9]"
    )  # fmt: skip
    (line,) = problems_of(tmp_path, near)
    assert line == (
        "15: linkage.sketch.B: B is too near to the line from A to C, 0.47 mm, to tell on which side it is; "
        "sketch another crank angle, or write the side in [linkage.branch]"
    )
    far = tmp_path / "far.toml"
    far.write_text(near.replace("[66, 9]", "[66, 12]"))
    assert load_linkage(far).table.signs == (("B", 1),)
    far.write_text(near.replace("[66, 9]", "[66, 5]"))
    assert load_linkage(far).table.signs == (("B", -1),)


@pytest.mark.parametrize("height", [9, 12])
def test_words_of_a_side_may_stand_beside_a_sketch_that_shows_it_or_shows_none(tmp_path, height):
    sketch = f"[linkage.sketch]\ncrank_angle = 40\nB = [66, {height}]\n[linkage.branch]"
    file = tmp_path / "both.toml"
    file.write_text(FOUR_BAR.replace("90", "60").replace("70", "40").replace("[linkage.branch]", sketch))
    assert load_linkage(file).table.signs == (("B", 1),)


def test_the_side_seen_from_the_other_end():
    sides = {
        words: Linkage(tomllib.loads(FOUR_BAR.replace("left of A C", words))).table.signs
        for words in ("left of A C", "right of A C", "left of C A", "right of C A")
    }
    assert list(sides.values()) == [(("B", 1),), (("B", -1),), (("B", -1),), (("B", 1),)]


def test_signs_of_the_reference_agree_with_solved_places():
    """The places of the reference at crank angles, solved without dyads, are on the sides that the sketches tell."""
    for case in REFERENCE["cases"]:
        if case["name"] in GROUPS:
            continue
        sketched = Linkage(tomllib.loads(case["table"]))
        for angle, signals in case["at"].items():
            sections = tomllib.loads(case["table"])
            places = {name: [float(signals[f"{name}_x"]), float(signals[f"{name}_y"])] for name in sketched.table.points
                      if f"{name}_x" in signals}  # fmt: skip
            sections["linkage"]["sketch"] = {"crank_angle": float(angle), **places}
            assert Linkage(sections) == sketched, (case["name"], angle)
