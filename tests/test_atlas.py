"""`explore atlas`: coupler curves as results."""

import numpy as np
import pytest
from command_line import run
from stopping import interrupt

import explore
from explore.results.store.all_designs_writer import AllDesignsWriter
from explore.synthesis.linkages import FourBar


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("atlas")
    output = run("atlas", "--count", "2048", cwd=path)
    assert "2,048 linkages, " in output.stderr
    assert output.stderr.endswith("-> results/atlas.h5; now run: explore rank results/atlas.h5\n")
    return path


def test_columns_are_those_of_the_curves(folder):
    """Against a polygon of 3,600 points: its sides are shorter than the curve by a part in a million."""
    table = explore.read_results(folder / "results" / "atlas.h5")
    assert len(table) == 2048
    angles = np.linspace(0, 2 * np.pi, 3601)
    for row in table[table["feasible"]].head(20).itertuples():
        point = complex(row.P_along, row.P_across) / row.coupler
        linkage = FourBar(0j, complex(row.ground), row.crank, row.coupler, row.rocker, point)
        curve = linkage.points(angles)
        assert np.abs(np.diff(curve)).sum() == pytest.approx(row.path_length, rel=1e-5)
        assert np.ptp(curve.imag) / np.ptp(curve.real) == pytest.approx(row.path_aspect, rel=1e-5)
        transmission = linkage.transmission_angles(angles)
        least = np.degrees(np.minimum(transmission, np.pi - transmission).min())
        assert least == pytest.approx(row.transmission_angle_worst, abs=1e-6)
        assert least >= 20


def test_the_other_commands_work_on_it(folder):
    ranked = run("rank", "--metric", "path_aspect:min", "--metric", "transmission_angle_worst:max", cwd=folder)
    assert "Pareto-optimal in path_aspect (min), transmission_angle_worst (max)" in ranked.stderr
    best = explore.rank(folder / "results" / "atlas.h5").index[0]
    assert "path_length" in run("show", "--design", str(best), cwd=folder).stdout
    run("report", "results/atlas.h5", "-o", "atlas.html", cwd=folder)
    assert "finished" in run("verify", "results/atlas.h5", cwd=folder).stdout


def test_the_same_again_changes_nothing_and_another_count_is_refused(folder):
    before = (folder / "results" / "atlas.h5").read_bytes()
    assert "2,048 linkages -> results/atlas.h5" in run("atlas", "--count", "2048", cwd=folder).stderr
    assert (folder / "results" / "atlas.h5").read_bytes() == before
    assert "--restart" in run("atlas", "--count", "1024", cwd=folder, code=1).stderr
    assert "is a folder" in run("atlas", "-o", "results", cwd=folder, code=1).stderr


def test_an_interrupted_atlas_says_what_continues_it(folder, tmp_path, monkeypatch):
    with monkeypatch.context() as patch:
        patch.setattr(AllDesignsWriter, "commit", interrupt)
        run("atlas", "--count", "2048", "-o", "cut.h5", cwd=tmp_path, code=130)
    shown = run("show", "cut.h5", cwd=tmp_path).stdout
    assert "run its `explore atlas --count 2048` again to continue" in shown
    run("atlas", "--count", "2048", "-o", "cut.h5", cwd=tmp_path)
    assert (tmp_path / "cut.h5").read_bytes() == (folder / "results" / "atlas.h5").read_bytes()
