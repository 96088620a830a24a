"""`explore plot` as a user meets it."""

import pytest
from command_line import assert_refused, call, on_terminal

from explore.cli.commands.plot import KINDS

#: Kinds that need more than the results of any study: a point of the coupler, a target.
OF_POINTS = ("path", "cognates", "burmester", "dwell")


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind not in OF_POINTS])
def test_a_picture_is_written_and_named(in_results, kind):
    code, out, err = call("plot", kind)
    assert (code, out, err) == (0, f"results/small-{kind}.png\n", "")
    first = (in_results / out.strip()).read_bytes()
    assert first.startswith(b"\x89PNG")
    call("plot", kind, "results/small.h5")
    assert (in_results / out.strip()).read_bytes() == first
    for ending, start in ((".svg", b"<?xml"), (".pdf", b"%PDF")):
        for name in ("a", "b"):
            assert call("plot", kind, "-o", name + ending) == (0, f"{name}{ending}\n", "")
        assert (in_results / f"a{ending}").read_bytes() == (in_results / f"b{ending}").read_bytes()
        assert (in_results / f"a{ending}").read_bytes().startswith(start)


def test_the_results_are_never_overwritten(in_results, few):
    (in_results / "trap.png").write_bytes(few.read_bytes())
    code, out, err = call("plot", "pareto", "trap.png", "-o", "trap.png")
    assert (code, out, err) == (2, "", "error: -o trap.png is the results file itself; name another file\n")
    assert (in_results / "trap.png").read_bytes() == few.read_bytes()


def test_a_link_is_kept_and_a_failed_write_is_reported(in_results):
    (in_results / "far").mkdir()
    (in_results / "far/picture.png").touch()
    (in_results / "link.png").symlink_to("far/picture.png")
    assert call("plot", "pareto", "-o", "link.png")[0] == 0
    assert (in_results / "link.png").is_symlink()
    assert (in_results / "far/picture.png").read_bytes().startswith(b"\x89PNG")
    (in_results / "lost.png").symlink_to("nowhere/picture.png")
    reply = call("plot", "pareto", "-o", "lost.png")
    assert_refused(reply, 1, "nowhere/picture.png cannot be created: No such file or directory")


def test_a_progress_bar_on_a_terminal(in_results):
    output, terminal_text = on_terminal("plot", "pareto", cwd=in_results)
    assert output == "results/small-pareto.png\n"
    assert "drawing" in terminal_text


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["paretto"], "unknown kind of figure 'paretto'; did you mean 'pareto'?"),
        (["pareto", "-o", "front.jpg"], "-o front.jpg: the name must end in .png, .svg or .pdf"),
        (["motion", "--x", "cv"], "--x does not apply to 'motion', only to pareto, map"),
        (["map", "--x", "coupler"], "parameter 'coupler' has one value in results/small.h5; a map needs one that"),
        (["map", "--x", "cv"], "results/small.h5 has no parameter 'cv'; available: crank, coupler, rocker, ground"),
        (["map", "--x", "crank", "--y", "crank"], "--x and --y are both 'crank'; name two parameters"),
        (["dwell"], "these designs have no slider that rests; draw their mechanism or motion instead"),
        (["path"], "the study has no path in [target] to compare with; a mechanism chart draws the paths"),
        (["motion", "--design", "4"], "no full turn to simulate: all links fall into one line"),
        (["pareto", "-o", "nowhere/front.png"], "-o nowhere/front.png: there is no folder nowhere; name another"),
        (["pareto", "other.h5"], "other.h5"),
    ],
)
def test_bad_input_is_one_clear_line(in_results, arguments, message):
    before = sorted(in_results.rglob("*"))
    assert_refused(call("plot", *arguments), (1, 2), f"error: {message}")
    assert sorted(in_results.rglob("*")) == before


def test_an_unfinished_front_says_how_far_it_is(in_results):
    (in_results / "results/front.h5.journal").write_bytes(b"")
    code, _, err = call("plot", "pareto", "results/front.h5")
    assert code == 1
    assert err.startswith("error: results/front.h5 is not finished: 0 of unknown blocks are done")
