"""Linkages of other programs: their studies have the drawn position, and what cannot be read is said in a line."""

import json
import math
import tomllib
from pathlib import Path

import pytest
from command_line import run
from hypothesis import given, settings
from hypothesis import strategies as st
from linkage_cases import evaluate_graph, trace

from explore import Linkage
from explore.base.errors import RequestError
from explore.studies.imports.sources import imported_study

SAMPLES = Path(__file__).parent / "imports"
#: For each sample the driver's points, drawn places of others, and the accuracy of what the file says, mm.
POSITIONS = {
    "pylinkage-slider-crank.json": (
        [(0.0, 0.0), (22.945265618534656, 19.32653061713073)],
        {"rod_1": (-76.6188635980046, 10.0)},
        1e-6,
    ),
    "pylinkage-watt-2.json": (
        [(0.0, 0.0), (18.64829904811993, 23.499807288824503)],
        {
            "coupler_1_rocker_1": (59.17256041687459, -56.860532683806625),
            "output_1_rod_1": (184.4468904649012, -69.77938789134794),
            "P": (51.57726988567652, 0.7911552024643846),
        },
        1e-6,
    ),
    "pyslvs-inverted.txt": ([(0.0, 0.0), (24.0, 18.0)], {"P4": (66.0, 50.0), "P5": (130.0, 45.0)}, 1e-6),
    "pmks-watt-2.txt": (
        [(0.0, 0.0), (24.0, 18.0)],
        {"B": (95.0, 72.0), "D": (142.5, 65.0), "S": (225.0, 21.25)},
        1e-6,
    ),
}


@pytest.mark.parametrize("name", POSITIONS)
def test_a_study_has_the_drawn_position(name):
    driver, places, accuracy = POSITIONS[name]
    text, _ = imported_study(str(SAMPLES / name))
    sections = tomllib.loads(text)
    equations = trace(Linkage(sections["linkage"]))
    values = {key: value for key, value in sections["parameters"].items() if key != "speed"}
    angle = math.atan2(driver[1][1] - driver[0][1], driver[1][0] - driver[0][0])
    for point, expected in places.items():
        found = evaluate_graph([series.terms[0] for series in equations.points[point]], values, angle)
        assert [float(x) for x in found] == pytest.approx(expected, abs=accuracy), point


def test_names_units_and_what_is_read_in_another_way(tmp_path):
    done = run("init", "six.toml", "--from", str(SAMPLES / "pmks-watt-2.txt"), cwd=tmp_path)
    assert "Motor crank is named Motor_crank\n" in done.stderr
    assert done.stderr.endswith("wrote six.toml; now run: explore sweep six.toml\n")
    sections = tomllib.loads((tmp_path / "six.toml").read_text())
    lengths = {"Motor_crank": 30, "coupler": math.hypot(71, 54), "rocker": math.hypot(5, 72),
               "rod": math.hypot(82.5, 43.75)}  # fmt: skip
    assert sections["parameters"].pop("speed") == "45 rpm"
    assert sections["parameters"] == pytest.approx(lengths)
    assert sections["linkage"]["links"]["Motor_crank"] == {"O": 0, "A": "Motor_crank"}
    listed = run("mechanisms", "six.toml", cwd=tmp_path).stdout
    assert "G_velocity" in listed

    _, remarks = imported_study(str(SAMPLES / "pyslvs-inverted.txt"))
    assert remarks == [
        "the expression names no driver, so L1 is: the first link with a pin in the frame",
        "L2 is a slot of L3, in which P1 slides",
    ]


def changed(**changes):
    return json.dumps(json.loads((SAMPLES / "pylinkage-slider-crank.json").read_text()) | changes)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("{", "is no JSON: "),
        ("{}", "has no list 'joints', so it is no mechanism of pylinkage"),
        ('{"joints": [{"name": "A", "id": "A", "type": "Static"}], "links": []}', "is of a linkage of old versions"),
        (changed(links=[]), "has no link of the type 'driver'"),
        (
            changed(joints=[{"id": "A", "position": [None, None]}]),
            "the joint A has no position; assemble the mechanism",
        ),
        (changed(joints=[{"id": "A", "position": [1e999, 0]}]), "the position of A is no finite number: inf"),
        ("[" * 100_000, "is no address of PMKS+"),
        ("M[J[R, P[0, 0], L[ground, L1]], J[X]]", "joint 1 of the expression is not J[type, P[x, y], L[links]]: J[X]"),
        ("M[J[R, P[0, 0], L[ground, L1]], J[R, P[nan, 0], L[L1]]]", "a number of P1 is not one: nan"),
        ("M[J[R, P[0, 0], L[ground]]]", "no link has a pin in the frame, so none can be the driver"),
        ("M[J[R, P[0, 0], L[ground, L1]], J[R, P[0, 0], L[L1]]]", "the first two points of L1 are at the same place"),
        ("M[J[R, P[0, 0], L[ground, L1]], J[R, P[9, 0], L[L1]]]", "as a table: linkage.links.L1: has one joint only"),
        ("https://app.pmksplus.com/", "is no address of PMKS+ with a linkage"),
        ("?00.CDG.j,0.100.MA,O,0.", "is no address of PMKS+ with a linkage"),
        ("?0.0.0.1011.MA,O,0.....", "a joint of the address is damaged: MA,O,0"),
        ("?0.0.0.1011.MA,O,0,0,0.pB,B,0,0,0..YPAB,AB,0,0,0,0,,A,B,....N_", "B is a driven slider or cylinder"),
    ],
)
def test_what_cannot_be_read_is_said_in_a_line(tmp_path, text, reason):
    (tmp_path / "file").write_text(text)
    for source in (str(tmp_path / "file"), text) if text.startswith(("M", "h", "?")) else [str(tmp_path / "file")]:
        with pytest.raises(RequestError) as error:
            imported_study(source)
        (line,) = str(error.value).splitlines()
        assert reason in line
        assert len(line) < 1500


def test_a_slot_of_a_moving_link_is_along_the_joints_that_the_address_names():
    """The lever's joints are C, E and D, and the slot of its block is along C and D; angles of such slots are 0."""
    joints = "MA,,0,0,0.GB,,Fe,Fe,0.KC,,ku,0,0.GE,,_W,NS,0.GD,,si,VG,0.HP,,Fe,Fe,0,CD,C,D.."
    links = "YRAB,,0,0,0,0,,A,B,,.YRCD,,0,0,0,0,,C,E,D,,.YPBP,,0,0,0,0,,B,P,,...N_k"
    address = f"?00.CDG.j,0.100.{joints}{links}"
    table = tomllib.loads(imported_study(address)[0])["linkage"]
    lever, (start, end) = table["links"]["CD"], table["slots"]["P"]["along"]
    line = complex(*lever["D"]) - lever["C"]
    assert ((complex(*end) - complex(*start)) / line).imag == pytest.approx(0.0, abs=1e-9)
    for damage in ("CD,C,C", "CD,C", "XY,C,D", "CD,C,B"):
        with pytest.raises(RequestError, match="^PMKS.: the slot P of the address is damaged: "):
            imported_study(address.replace("CD,C,D.", f"{damage}."))


def test_pylinkage_turns_clockwise_at_a_negative_rate_and_draws_sliders_on_their_lines(tmp_path):
    data = json.loads((SAMPLES / "pylinkage-slider-crank.json").read_text())
    (crank,) = (link for link in data["links"] if link["type"] == "driver")
    (slider,) = (joint for joint in data["joints"] if joint["type"] == "prismatic")
    crank["angular_velocity"] *= -1.0
    (tmp_path / "file").write_text(json.dumps(data))
    _, (remark, *_) = imported_study(str(tmp_path / "file"))
    assert remark == "crank turns counter-clockwise here, and clockwise in pylinkage"
    slider["line_point"][1] += 5.0
    (tmp_path / "file").write_text(json.dumps(data))
    with pytest.raises(RequestError, match="is not on its line; assemble the mechanism before you save it$"):
        imported_study(str(tmp_path / "file"))


@given(st.data())
@settings(max_examples=300, deadline=None)
def test_damaged_texts_are_read_or_refused(tmp_path_factory, data):
    name = data.draw(st.sampled_from(list(POSITIONS)))
    text = (SAMPLES / name).read_text()
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(text)))
        text = text[:at] + data.draw(st.text(max_size=3)) + text[at + data.draw(st.integers(0, 30)) :]
    file = tmp_path_factory.getbasetemp() / "damaged"
    file.write_text(text, encoding="utf-8", errors="surrogatepass")
    reason = study = ""
    try:
        study, _ = imported_study(str(file))
    except RequestError as error:
        reason = str(error)
    assert len(reason.splitlines()) <= 1
    assert reason or Linkage(tomllib.loads(study)["linkage"])
