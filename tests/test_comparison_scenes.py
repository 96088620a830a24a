"""Scenes: the files that come with the package, and the section [scene] of a study file."""

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from loop_cases import rockers
from studies import GOOD

from explore.comparison.methods.closed_form import geometric_outcome
from explore.comparison.methods.contract import Level, Outcome
from explore.comparison.scenes import bundled_scenes, load_scene
from explore.evaluation.evaluate import evaluate_columns
from explore.mechanisms.registry import MECHANISMS
from explore.studies.config.schema import SceneTable
from explore.studies.request.requests import make_request

ROOT = Path(__file__).parents[1]
SCENES = {name: load_scene(path) for name, path in bundled_scenes().items()}
SECTION = '[scene]\ntitle = "A"\nabout = "B."\nmodel = "velocities"\nquestion = "C?"\n'
#: Number of linkages, lowest level that answers the question, and geometric outcome; None where outcomes differ.
EXPECTED = {
    "smooth": (1, Level.ACCELERATIONS, Outcome.OK),
    "published_optimum": (1, Level.VELOCITIES, Outcome.OK),
    "almost_change_point": (6, Level.ACCELERATIONS, Outcome.OK),
    "change_point": (1, Level.GEOMETRY, Outcome.CHANGE_POINT),
    "blocked_crank": (1, Level.GEOMETRY, Outcome.CRANK_BLOCKED),
    "unassemblable": (1, Level.GEOMETRY, Outcome.CANNOT_ASSEMBLE),
    "tiny_swing": (1, Level.POSITIONS, Outcome.OK),
    "extreme_ratios": (4, Level.VELOCITIES, Outcome.OK),
    "large_block": (256, Level.VELOCITIES, None),
    "slider_crank": (1, Level.ACCELERATIONS, Outcome.OK),
    "slider_almost_change_point": (5, Level.ACCELERATIONS, Outcome.OK),
    "variable_crank": (1, Level.ACCELERATIONS, Outcome.OK),
}


def outcomes_of(designs):
    return geometric_outcome(designs.task(np.zeros((len(designs), 1))))


def test_the_bundled_scenes_are_the_expected_ones():
    assert SCENES.keys() == EXPECTED.keys()


@pytest.mark.parametrize("name", EXPECTED)
def test_bundled_scenes_have_their_contents(name):
    scene, (count, model, outcome) = SCENES[name], EXPECTED[name]
    assert scene.name == name
    assert scene.designs.parameters.shape == (count, len(scene.designs.loop.parameters))
    assert scene.model is model
    assert scene.title
    assert scene.about.endswith(".")
    assert scene.question.endswith("?")
    if outcome is not None:
        assert outcomes_of(scene.designs).tolist() == [outcome] * count


def test_margins_decrease_to_the_smallest_that_is_not_a_change_point():
    """The margins, summed as fractions, are the powers of two that the file states."""
    margins = [
        Fraction(c) + Fraction(d) - Fraction(a) - Fraction(b)
        for a, b, c, d, _ in SCENES["almost_change_point"].designs.parameters
    ]
    assert margins == [Fraction(1, 2**k) for k in (7, 13, 20, 27, 33, 39)]
    # the next power of two counts as a change point
    closer = rockers([[150.0, 1083.5, 541.75, 691.75 + 2.0**-40]])
    assert outcomes_of(closer).tolist() == [Outcome.CHANGE_POINT]


def test_the_large_block_contains_one_change_point():
    designs = SCENES["large_block"].designs
    without_motion = np.flatnonzero(outcomes_of(designs) != Outcome.OK)
    assert designs.parameters[without_motion, :4].tolist() == [[150.0, 1083.5, 541.75, 691.75]]


def test_the_tiny_swing_is_a_hundredth_of_a_degree():
    columns = SCENES["tiny_swing"].designs.columns
    request = make_request(MECHANISMS["crank-rocker"], metrics=["swing_angle"])
    assert evaluate_columns(request, columns).columns["swing_angle"][0] == pytest.approx(0.01, rel=0.05)


def test_models_are_named_after_the_levels():
    allowed = SceneTable.model_fields["model"].annotation.__args__
    assert [Level[name.upper()] for name in allowed] == list(Level)


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ("model", "modle", "study.toml:10: scene.modle: unknown key; did you mean 'model'?"),
        (
            "velocities",
            "speed",
            "study.toml:10: scene.model: must be 'geometry', 'positions', 'velocities' or 'accelerations', got 'speed'",
        ),
        ('"A"', "3", "study.toml:8: scene.title: must be a string in quotes, got 3"),
        (
            'about = "B."\n',
            "",
            "study.toml:7: scene: the key 'about' is missing; a complete table has title, about, model, question",
        ),
    ],
)
def test_errors_in_a_scene(problems, old, new, problem):
    assert problems(GOOD + SECTION.replace(old, new, 1)) == [problem]


def test_all_errors_are_reported_together(problems):
    text = GOOD.replace("crank = 100", "crank = -100") + SECTION.replace("velocities", "speeds").replace('"C?"', "3")
    assert [problem.split(": ")[:2] for problem in problems(text)] == [
        ["study.toml:3", "parameters.crank"],
        ["study.toml:10", "scene.model"],
        ["study.toml:11", "scene.question"],
    ]


def test_a_scene_that_is_not_a_table(problems):
    assert problems("scene = 3\n" + GOOD) == ["study.toml:1: scene: must be a table of keys and values, got 3"]


def test_an_empty_scene_misses_all_four_keys(problems):
    assert len(problems(GOOD + "[scene]\n")) == 4


def test_of_a_study_that_is_no_scene_a_few_designs_are_taken(tmp_path):
    path = tmp_path / "study.toml"
    path.write_text(GOOD.replace("crank = 100", "crank = { start = 60, stop = 100, num = 41 }"), encoding="utf-8")
    scene = load_scene(path)
    assert (scene.name, scene.about, scene.model) == ("study", "8 of 41 designs", Level.ACCELERATIONS)
    assert scene.designs.columns["crank"].tolist() == [60.0, 65.0, 71.0, 77.0, 82.0, 88.0, 94.0, 100.0]


def test_a_scene_does_not_change_the_hash_of_a_study(load):
    study, scene_study = load(GOOD), load(GOOD + SECTION)
    assert study.sha256 == scene_study.sha256
    assert study.identity == scene_study.identity


def test_the_branch_of_a_scene(tmp_path):
    path = tmp_path / "mirrored.toml"
    path.write_text(GOOD + "branch = [1, -1]\n" + SECTION, encoding="utf-8")
    scene = load_scene(path)
    assert scene.name == "mirrored"
    assert scene.designs.parameters.tolist() == [[100.0, 1000.0, 500.0, 700.0, branch] for branch in (1.0, -1.0)]
