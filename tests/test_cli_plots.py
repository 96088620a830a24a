"""`explore plot` as a user meets it."""

import pytest
from command_line import call, on_terminal

import explore
from explore.cli.plots import KINDS

STUDY = """mechanism = "crank-rocker"
[parameters]
crank = [80, 100, 150, 160]
coupler = 1083.4236
rocker = 541.7118
ground = [691.7118, 720]
"""


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    folder = tmp_path_factory.mktemp("swept")
    (folder / "small.toml").write_text(STUDY)
    return explore.sweep(explore.load_study(folder / "small.toml"), folder / "small.h5").path


@pytest.fixture
def swept(results, tmp_path, monkeypatch):
    """The current folder, with results."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "results").mkdir()
    (tmp_path / "results/small.h5").write_bytes(results.read_bytes())
    return tmp_path


@pytest.mark.parametrize("kind", KINDS)
def test_a_picture_is_written_and_named(swept, kind):
    code, out, err = call("plot", kind)
    assert (code, out, err) == (0, f"results/small-{kind}.png\n", "")
    first = (swept / out.strip()).read_bytes()
    assert first.startswith(b"\x89PNG")
    call("plot", kind, "results/small.h5")
    assert (swept / out.strip()).read_bytes() == first
    for ending, start in ((".svg", b"<?xml"), (".pdf", b"%PDF")):
        for name in ("a", "b"):
            assert call("plot", kind, "-o", name + ending) == (0, f"{name}{ending}\n", "")
        assert (swept / f"a{ending}").read_bytes() == (swept / f"b{ending}").read_bytes()
        assert (swept / f"a{ending}").read_bytes().startswith(start)


def test_the_results_are_never_overwritten(swept, results):
    (swept / "trap.png").write_bytes(results.read_bytes())
    code, out, err = call("plot", "pareto", "trap.png", "-o", "trap.png")
    assert (code, out, err) == (2, "", "error: -o trap.png is the results file itself; name another file\n")
    assert (swept / "trap.png").read_bytes() == results.read_bytes()


def test_a_link_stays_one_and_what_cannot_be_written_is_said(swept):
    (swept / "far").mkdir()
    (swept / "far/picture.png").touch()
    (swept / "link.png").symlink_to("far/picture.png")
    assert call("plot", "pareto", "-o", "link.png")[0] == 0
    assert (swept / "link.png").is_symlink()
    assert (swept / "far/picture.png").read_bytes().startswith(b"\x89PNG")
    (swept / "lost.png").symlink_to("nowhere/picture.png")
    code, out, err = call("plot", "pareto", "-o", "lost.png")
    assert (code, out) == (1, "")
    assert err.startswith("error: ")
    assert "nowhere/picture.png cannot be created: No such file or directory" in err
    assert err.count("\n") == 1


def test_something_moves_on_a_terminal(swept):
    output, said = on_terminal("plot", "pareto", cwd=swept)
    assert output == "results/small-pareto.png\n"
    assert "drawing" in said


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["paretto"], "unknown kind of figure 'paretto'; did you mean 'pareto'?"),
        (["pareto", "-o", "front.jpg"], "-o front.jpg: the name must end in .png, .svg or .pdf"),
        (["pareto", "-o", "front"], "-o front: the name must end in .png, .svg or .pdf"),
        (["pareto", "--x", "swing"], "results/small.h5 has no column of numbers 'swing'; did you mean 'swing_angle'?"),
        (["pareto", "--design", "8"], "results/small.h5 has no design 8: they are numbered 0 to 7"),
        (["motion", "--x", "cv"], "--x means nothing for 'motion'; it belongs to pareto, map"),
        (["pareto", "--metric", "cv"], "--metric means nothing for 'pareto'; it belongs to map"),
        (["map", "--x", "coupler"], "parameter 'coupler' has one value in results/small.h5; a map needs one that"),
        (["map", "--x", "cv"], "results/small.h5 has no parameter 'cv'; there is crank, coupler, rocker, ground"),
        (["map", "--x", "crank", "--y", "crank"], "--x and --y are both 'crank'; name two parameters"),
        (
            ["parallel", "--design", "1"],
            "--design means nothing for 'parallel'; it belongs to pareto, motion, mechanism",
        ),
        (["motion", "--design", "4"], "no full turn to simulate: all links fall into one line"),
        (["mechanism", "--design", "4"], "no full turn to simulate: all links fall into one line"),
        (["pareto", "-o", "nowhere/front.png"], "-o nowhere/front.png: there is no folder nowhere; name another"),
        (["pareto", "other.h5"], "other.h5"),
    ],
)
def test_bad_input_is_one_clear_line(swept, arguments, message):
    before = sorted(swept.rglob("*"))
    code, out, err = call("plot", *arguments)
    assert code in (1, 2)
    assert out == ""
    assert err.count("\n") == 1
    assert err.startswith(f"error: {message}")
    assert sorted(swept.rglob("*")) == before


def test_an_unfinished_front_says_how_far_it_is(swept):
    (swept / "results/front.h5.journal").write_bytes(b"")
    code, _, err = call("plot", "pareto", "results/front.h5")
    assert code == 1
    assert err.startswith("error: results/front.h5 is not finished: 0 of unknown blocks are done")
