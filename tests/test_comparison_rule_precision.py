"""Errors of averaging rules on scenes of linkages of tables with several loops."""

from command_line import succeed

from explore.comparison import rule_precision
from explore.comparison.averaging_rules import AVERAGING_RULES
from explore.comparison.scenes import load_scene


def test_averages_of_five_loops_are_those_of_the_multiple_precision(tmp_path, monkeypatch):
    """Of one design, by panels that are graded towards singularities; the other rules are further off."""
    monkeypatch.chdir(tmp_path)
    succeed("init", "jansen.toml", "--linkage", "jansen")
    monkeypatch.setattr(rule_precision, "AVERAGING_RULES", {"graded": AVERAGING_RULES["graded"][-1:]})
    scene = load_scene(tmp_path / "jansen.toml")
    assert len(scene.designs.loop.chains) == 5
    rows = rule_precision.compare_rules(scene)
    assert [(row["window"], row["designs"]) for row in rows] == [("drive", 1), ("cycle", 1)]
    for row in rows:
        errors = [value for name, value in row.items() if name.endswith("_error") and value == value]
        assert len(errors) >= 9
        assert max(errors) < 2e-14, row  # rounding of accelerations
