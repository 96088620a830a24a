"""The command line in units of the study's [units] and of --units; the results file stays in declared units."""

import io
import json
import math
import re
import tomllib

import numpy as np
import pandas as pd
import pytest
from command_line import call, run
from studies import sweep_text

import explore
from explore import charts
from explore.base.units.shown import ShownUnits, read_shown_units
from explore.cli.units import open_shown

STUDY = """mechanism = "crank-rocker"
[parameters]
crank = ["2 in", "3 in", "4 in", "6 in"]
coupler = { start = "900 mm", stop = "1000 mm", num = 4 }
rocker = { start = "500 mm", stop = "600 mm", num = 3 }
ground = "700 mm"
speed = "60 rpm"
[evaluate]
metrics = ["cv", "swing_angle", "mean", "variance", "transmission_angle_min"]
[constraints]
transmission_angle_min = { min = 30 }
[rank]
metrics = ["cv", "swing_angle:max"]
"""
UNITS = '[units]\nlength = "in"\nspeed = "rpm"\n'
CHOICES = ("--units", "length=in", "--units", "speed=rpm")
LENGTHS = {"crank": "1 mm", "coupler": "3 mm", "rocker": "3 mm", "ground": "3 mm"}
INCH, RPM = 25.4, 2.0 * np.pi / 60.0


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The same study without units and with them, swept."""
    folder = tmp_path_factory.mktemp("units")
    for name, text in (("plain", STUDY), ("inch", STUDY + UNITS)):
        (folder / f"{name}.toml").write_text(text)
        run("sweep", f"{name}.toml", cwd=folder)
    return folder


def test_the_units_change_neither_the_identity_nor_the_columns(folder):
    plain, inch = (explore.load_study(folder / f"{name}.toml") for name in ("plain", "inch"))
    assert plain.sha256 == inch.sha256
    assert plain == inch
    first, second = (explore.read_results(folder / "results" / f"{name}.h5") for name in ("plain", "inch"))
    pd.testing.assert_frame_equal(first, second, check_exact=True)
    assert second.attrs["units"]["crank"] == "mm"


def test_a_study_in_python_has_the_units(folder):
    study = explore.Study(mechanism="crank-rocker", parameters=LENGTHS, units={"length": "in"})  # fmt: skip
    assert tomllib.loads(study.to_toml())["units"] == {"length": "in"}
    with pytest.raises(explore.ConfigError, match=r"^units.length: unknown unit 'inn'; did you mean 'in'\?$"):
        explore.Study(mechanism="crank-rocker", parameters=LENGTHS, units={"length": "inn"})  # fmt: skip


def test_edited_units_resume_the_sweep_and_say_how_to_show_it(folder, tmp_path):
    (tmp_path / "study.toml").write_text(STUDY)
    run("sweep", "study.toml", cwd=tmp_path)
    before = (tmp_path / "results" / "study.h5").read_bytes()
    (tmp_path / "study.toml").write_text(STUDY + UNITS)
    lines = run("sweep", "study.toml", cwd=tmp_path).stderr.splitlines()
    assert lines[0] == "results/study.h5 is complete already: 48 designs"
    advice = "to show it in these units: --units length=in --units speed=rpm"
    assert lines[1:] == [f"[units] differs from the one that results/study.h5 was made with; {advice}"]
    assert (tmp_path / "results" / "study.h5").read_bytes() == before
    assert run("sweep", "inch.toml", cwd=folder).stderr.count("[units]") == 0


def test_the_unit_is_named_wherever_it_is_not_the_declared_one(folder, tmp_path):
    declared = explore.rank(folder / "results" / "plain.h5")
    run("rank", "results/inch.h5", "-o", tmp_path / "front.csv", cwd=folder)
    table = pd.read_csv(tmp_path / "front.csv", index_col="design")
    records = json.loads(run("rank", "results/plain.h5", *CHOICES, "--json", cwd=folder).stdout)
    assert [record["design"] for record in records] == declared.index.tolist() == table.index.tolist()
    assert "crank" not in table
    # 2e-16 for each of the factor, its inverse here and the division.
    for name, unit, size in (("crank", "in", INCH), ("mean", "rpm", RPM), ("variance", "rpm^2", RPM**2)):
        np.testing.assert_allclose(table[f"{name} [{unit}]"] * size, declared[name], rtol=1e-15)
        np.testing.assert_allclose([r[f"{name} [{unit}]"] for r in records], table[f"{name} [{unit}]"], rtol=0.0)
    np.testing.assert_array_equal(table["cv"], declared["cv"])
    shown = run("rank", "results/inch.h5", cwd=folder).stdout
    assert re.search(r" in +in +in +in +rpm +cv +deg$", shown, re.MULTILINE)
    assert run("rank", "results/plain.h5", *CHOICES, cwd=folder).stdout == shown
    assert (
        run("rank", "results/inch.h5", "--units", "declared", cwd=folder).stdout
        == run("rank", "results/plain.h5", "--units", "declared", cwd=folder).stdout
    )


@pytest.mark.parametrize(
    "options", [("--where", "crank <= 4 and mean > 5"), ("--limit", "mean>=5", "--where", "crank <= 4")]
)
def test_numbers_without_a_unit_are_in_the_shown_one(folder, options):
    designs = [
        [record["design"] for record in json.loads(run("rank", *arguments, "--json", cwd=folder).stdout)]
        for arguments in (
            ("results/inch.h5", *options),
            ("results/plain.h5", *CHOICES, *options),
            ("results/plain.h5", "--where", "crank <= 101.6 and mean > 5 rpm"),
            ("results/inch.h5", "--units", "declared", "--where", "crank <= 10.16 cm and mean > 5 rpm"),
        )
    ]
    assert designs[0]
    assert designs == [designs[0]] * 4


def test_designs_are_shown_in_the_chosen_units(folder):
    record = json.loads(run("show", "results/inch.h5", "--design", 7, "--json", cwd=folder).stdout)
    assert record["crank [in]"] == 2.0
    assert "transmission_angle_min_margin" in record
    lines = run("show", "results/plain.h5", *CHOICES, "--design", 7, cwd=folder).stdout.splitlines()
    assert any(line.split()[:3] == ["crank", "2", "in"] for line in lines)
    pair = run("show", "results/inch.h5", "--design", 0, "--design", 47, "--json", cwd=folder).stdout
    assert json.loads(pair)["differences"][0]["absolute"]["crank [in]"] == 4.0
    columns = run("show", "results/inch.h5", cwd=folder).stdout
    assert re.search(r"^ mean +rpm +mean of", columns, re.MULTILINE)


def test_near_misses_are_in_the_chosen_units(folder):
    options = ("--nearest", 2, "--limit", "coupler<=36")
    inches, plain = (
        json.loads(run("rank", f"results/{name}.h5", *arguments, "--json", cwd=folder).stdout)
        for name, arguments in (("inch", options), ("plain", ("--nearest", 2, "--limit", "coupler<=914.4")))
    )
    assert [record["design"] for record in inches] == [record["design"] for record in plain]
    assert inches[0]["coupler_margin"] == pytest.approx(plain[0]["coupler_margin"] / INCH, rel=1e-12)
    lines = run("rank", "results/inch.h5", *options, cwd=folder).stdout.splitlines()
    (line,) = (line for line in lines if line.startswith(" coupler "))
    assert line.split()[1] == "in"
    assert float(line.split()[4]) == pytest.approx((933.3333333 - 914.4) / INCH, abs=1e-4)


def test_polished_designs_are_in_the_chosen_units(folder):
    declared, inches = (
        json.loads(run("polish", f"results/{name}.h5", "--json", cwd=folder).stdout)[0] for name in ("plain", "inch")
    )
    assert inches["coupler [in]"] == pytest.approx(declared["coupler"] / INCH, rel=1e-15)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("length", "--units length: write QUANTITY=UNIT, such as length=in, or declared"),
        ("length=inn", "--units length=inn: unknown unit 'inn'; did you mean 'in'?"),
    ],
)
def test_wrong_units_get_one_line(folder, text, message):
    assert run("rank", "results/plain.h5", "--units", text, cwd=folder, code=2).stderr == f"error: {message}\n"


def test_wrong_units_of_a_study_are_named_with_their_line(tmp_path):
    (tmp_path / "study.toml").write_text(f'{STUDY}[units]\nlength = "rpm"\nspede = "rpm"\n')
    lines = run("sweep", "study.toml", cwd=tmp_path, code=2).stderr.splitlines()
    assert lines == [
        "error: study.toml:15: units.length: 'rpm' cannot be converted to 'mm'; use mm, cm, m or in",
        "study.toml:16: units.spede: no such quantity; did you mean 'speed'?",
    ]


def test_figures_are_in_the_chosen_units(folder):
    plain = explore.open_results(folder / "results" / "plain.h5")
    inches = plain.in_units(read_shown_units({"length": "in", "speed": "rpm", "angle": "rad"}))
    first, second = (charts.pareto_chart(results, x="crank", y="mean").axes[0] for results in (plain, inches))
    assert (second.get_xlabel(), second.get_ylabel()) == (
        first.get_xlabel().replace("[mm]", "[in]"), first.get_ylabel().replace("[rad/s]", "[rpm]")
    )  # fmt: skip
    star = [panel.get_lines()[-1].get_xydata()[0] for panel in (first, second)]
    np.testing.assert_allclose(star[1] * [INCH, RPM], star[0], rtol=1e-15)
    panels = zip(charts.motion_chart(plain).axes, charts.motion_chart(inches).axes, strict=True)
    factors = {}
    for declared, shown in panels:
        curves = [panel.get_lines()[0].get_ydata() for panel in (declared, shown)]
        unit = shown.get_ylabel().partition("[")[2].removesuffix("]")
        known = np.isfinite(curves[0]) & (curves[0] != 0.0)
        (factors[unit],) = {f"{factor:.9g}" for factor in curves[1][known] / curves[0][known]}
        bounds = [panel.get_lines()[-1].get_ydata()[0] for panel in (declared, shown)]
        assert len(declared.get_lines()) == len(shown.get_lines())
        assert bounds[1] == pytest.approx(bounds[0] * float(factors[unit]), rel=1e-8), "bounds, means and zero lines"
    assert factors == {"rad": "0.0174532925", "rpm": "9.54929659", "rad/s²": "1", "1": "1"}


def test_a_drawing_has_round_numbers_of_the_chosen_unit(folder):
    plain = explore.open_results(folder / "results" / "plain.h5")
    panel = charts.mechanism_chart(plain.in_units(read_shown_units({"length": "in"}))).axes[0]
    panel.figure.canvas.draw()
    low, high = panel.get_xlim()
    ticks = [(tick, label.get_text()) for tick, label in zip(panel.get_xticks(), panel.get_xticklabels(), strict=True)]
    inside = [(tick, float(text.replace("−", "-"))) for tick, text in ticks if low <= tick <= high]
    assert panel.get_xlabel() == "x [in]"
    assert len(inside) >= 4
    for tick, number in inside:
        assert tick == pytest.approx(number * INCH, rel=1e-15)
        assert number % 2.5 == 0.0
    assert plain.declared is plain
    assert charts.mechanism_chart(plain).axes[0].get_xlabel() == "x [mm]"


def test_the_command_draws_in_the_units_of_the_study(folder, tmp_path):
    run("plot", "mechanism", "results/inch.h5", "-o", tmp_path / "inch.svg", cwd=folder)
    run("plot", "mechanism", "results/plain.h5", *CHOICES, "-o", tmp_path / "plain.svg", cwd=folder)
    texts = [re.findall(r"<!-- (.*?) -->", (tmp_path / f"{name}.svg").read_text()) for name in ("inch", "plain")]
    assert "x [in]" in texts[0]
    assert [text.replace("inch", "plain") for text in texts[0]] == texts[1]


def test_a_control_curve_in_the_chosen_units(folder, tmp_path):
    """The same intervals from bare numbers in the shown units, from --set too, as from declared ones."""
    options = ("--design", 7, "--parameter", "crank", "--metric", "rocker_velocity_rms")
    declared = ("--from", "5 rpm", "--to", "9 rpm", "--start", "25.4", "--stop", "152.4", "--set", "coupler=965.2")
    shown = ("--from", "5", "--to", "9", "--start", "1", "--stop", "6", "--set", "coupler=38")
    plain = json.loads(run("tune", "results/plain.h5", *options, *declared, "--json", cwd=folder).stdout)
    command = ("tune", "results/inch.h5", *options, *shown)
    found = run(*command, "--json", "-o", tmp_path / "curve.csv", "-o", tmp_path / "curve.svg", cwd=folder)
    inch = json.loads(found.stdout)
    assert "coupler = 38 in, " in found.stderr
    assert (inch["parameter"], inch["metric"]) == ("crank [in]", "rocker_velocity_rms [rpm]")
    table = pd.read_csv(tmp_path / "curve.csv")
    # 2e-16 for each of the factor, its inverse here and the division.
    for name, size in (("crank [in]", INCH), ("rocker_velocity_rms [rpm]", RPM)):
        expected = [row[name.partition(" ")[0]] for row in plain["curve"]]
        np.testing.assert_allclose([row[name] * size for row in inch["curve"]], expected, rtol=1e-15)
        np.testing.assert_array_equal(table[name], [row[name] for row in inch["curve"]])
    assert len(inch["intervals"]) == len(plain["intervals"]) > 0
    for one, other in zip(inch["intervals"], plain["intervals"], strict=True):
        assert one["start"]["parameter"] * INCH == pytest.approx(other["start"]["parameter"], rel=1e-15)
        assert one["stop"]["value"] * RPM == pytest.approx(other["stop"]["value"], rel=1e-15)
    assert re.search(r"rocker_velocity_rms from 5 rpm to 9 rpm: crank [\d.]+ in", run(*command, cwd=folder).stdout)
    assert "crank [in]" in (tmp_path / "curve.svg").read_text()


def test_a_control_curve_of_a_mechanism_in_inches(tmp_path):
    settings = [word for text in ("coupler=900", "rocker=500", "ground=700") for word in ("--set", f"{text} mm")]
    command = ("tune", "--mechanism", "crank-rocker", *settings, "--parameter", "crank", "--metric", "swing_angle")
    shown, plain = (
        json.loads(run(*command, "--from", "20", "--json", *options, cwd=tmp_path).stdout)
        for options in (("--units", "length=in", "--stop", "5"), ("--stop", "127"))
    )
    ends = [result["intervals"][0]["start"]["parameter"] for result in (shown, plain)]
    assert ends[0] * INCH == pytest.approx(ends[1], rel=1e-15)
    code, _, err = call(*command, "--units", "length=in", "--start", "5", "--stop", "2")
    assert (code, err.count("--start = 5 is above --stop = 2")) == (2, 1)


def test_a_motion_in_the_chosen_units(folder, tmp_path):
    """The input angle keeps its degrees; numbers of --set and --point are in inches, as the columns are."""
    options = ("--design", "1", "--angles", "7", "--set", "ground=28")
    declared = ("simulate", "plain.toml", *options[:-1], "ground=711.2 mm")
    plain, mixed, shown = (
        run(*command, cwd=folder)
        for command in (
            (*declared, "--point", "knife=101.6,50.8"),
            ("simulate", "inch.toml", *options, "--point", "knife=4,2 in"),
            ("simulate", "plain.toml", *options, *CHOICES, "--point", "knife=4,2", "-o", tmp_path / "motion.csv"),
        )
    )
    motion, table = (pd.read_csv(io.StringIO(output.stdout)) for output in (plain, mixed))
    pd.testing.assert_frame_equal(pd.read_csv(tmp_path / "motion.csv"), table, check_exact=True)
    assert ", but ground = 28 in" in shown.stderr
    pd.testing.assert_series_equal(table.iloc[:, 0], motion.iloc[:, 0], check_exact=True)
    # 2e-16 for each of the factor, its inverse here and the division.
    for name, unit, size in (
        ("knife_x", "in", INCH),
        ("knife_velocity_x", "in/s", INCH),
        ("rocker_velocity", "rpm", RPM),
    ):
        assert name not in table
        np.testing.assert_allclose(table[f"{name} [{unit}]"] * size, motion[name], rtol=1e-15)
    same = run(*declared, "--units", "length=mm", "--units", "speed=rad/s", cwd=folder)
    assert same.stdout == run(*declared, cwd=folder).stdout


def test_the_plan_of_a_sweep_is_in_the_units_of_the_study(folder):
    plain, inch = (run("sweep", f"{name}.toml", "--dry-run", cwd=folder).stdout for name in ("plain", "inch"))
    rows = [[line.split() for line in output.splitlines() if re.match(r" *\d", line)] for output in (plain, inch)]
    # The speed and the crank of the last design: 60 rpm and 6 in.
    assert "rpm" in inch
    assert "rpm" not in plain
    assert {"6.28319", "152.4"} <= set(rows[0][-1])
    assert {"60", "6"} <= set(rows[1][-1])


def test_the_table_of_certified_designs_is_in_the_chosen_units(folder):
    """Enclosures stay in declared units, in which they are proved: a rounded factor would not enclose."""
    command = ("certify", "results/plain.h5", "--design", 7)
    (plain,), (inch,) = (
        json.loads(run(*command, *options, "--json", cwd=folder).stdout) for options in ((), ("--units", "angle=rad"))
    )
    assert plain == inch
    table = run(*command, "--units", "angle=rad", cwd=folder).stdout
    assert re.search(r" rad$", table, re.MULTILINE)
    (row,) = (line.split() for line in table.splitlines() if line.split()[:1] == ["7"])
    swing = math.radians(0.5 * (plain["swing_angle_lower"] + plain["swing_angle_upper"]))
    assert float(row[-1]) == pytest.approx(swing, rel=1e-14)  # printed with 15 digits


def test_tolerances_in_the_chosen_units(folder, tmp_path):
    """0.004 in is 0.1016 mm exactly, so the same parts are drawn; the results file stays in declared units."""
    options = ("--design", "7", "--draws", "4096", "--tolerance", "rocker=0.2 mm:uniform")
    declared = ("tolerance", "results/plain.h5", *options, "--tolerance", "crank=0.1016", "--units", "declared")
    command = ("tolerance", "results/inch.h5", *options, "--tolerance", "crank=0.004")
    plain = json.loads(run(*declared, "--json", "-o", tmp_path / "plain.h5", cwd=folder).stdout)
    outputs = [word for name in ("inch.h5", "inch.csv", "inch.svg") for word in ("-o", tmp_path / name)]
    inch = json.loads(run(*command, "--json", *outputs, cwd=folder).stdout)
    assert inch["tolerances"]["crank [in]"]["plus_minus"] == pytest.approx(0.004, rel=1e-15)
    assert inch["failures"] == plain["failures"]
    size = {"in": INCH, "rpm": RPM, "rpm^2": RPM**2, "": 1.0}
    units = {name: name.partition(" [")[2].removesuffix("]") for name in inch["designs"][0]}
    units |= {row["metric"]: row["metric"].partition(" [")[2].removesuffix("]") for row in inch["metrics"]}
    assert {units["variance [rpm^2]"], units["mean [rpm]"], units["cv"]} == {"rpm^2", "rpm", ""}
    # 2e-16 for each of the factors, their quotient, the product here and that of the command.
    for shown, row in zip(inch["metrics"], plain["metrics"], strict=True):
        for name in ("nominal", "mean", "std", "std_first_order", "low", "high"):
            assert shown[name] * size[units[shown["metric"]]] == pytest.approx(row[name], rel=2e-15)
    for shown, row in zip(inch["derivatives"], plain["derivatives"], strict=True):
        assert shown["parameter"] == f"{row['parameter']} [in]"
        for name, factor in (("derivative", 1 / INCH), ("error", 1 / INCH), ("share", 1.0)):
            factor *= 1.0 if name == "share" else size[units[shown["metric"]]]
            assert shown[name] * factor == pytest.approx(row[name], rel=2e-15)
    for name in ("crank [in]", "mean [rpm]", "variance [rpm^2]"):
        declared_value = plain["designs"][0][name.partition(" ")[0]]
        assert inch["designs"][0][name] * size[units[name]] == pytest.approx(declared_value, rel=1e-15)
    (row,) = pd.read_csv(tmp_path / "inch.csv").to_dict(orient="records")
    assert row["crank [in]"] == 2.0
    first, second = (explore.read_results(tmp_path / f"{name}.h5") for name in ("plain", "inch"))
    pd.testing.assert_frame_equal(first, second, check_exact=True)
    assert "crank ± 0.004 in" in " ".join((tmp_path / "inch.svg").read_text().split())
    table = run(*command, cwd=folder).stdout
    assert re.search(r"^ metric +± 0\.004 in +± 0\.00787 in$", table, re.MULTILINE)
    assert re.search(r"^ variance \[rpm\^2\] ", table, re.MULTILINE)
    front = run("tolerance", "results/inch.h5", "--draws", "64", "--tolerance", "crank=0.004", cwd=folder).stdout
    same = run("tolerance", "results/plain.h5", "--draws", "64", "--tolerance", "crank=0.1016", cwd=folder).stdout
    designs = [re.findall(r"^ *(\d+) ", output, re.MULTILINE) for output in (front, same)]
    assert designs[0] == designs[1] != []
    wrong = run("tolerance", "results/inch.h5", "--tolerance", "crank=1e999", cwd=folder, code=2).stderr
    assert wrong == "error: --tolerance crank: the number is too large\n"


def test_coverage_in_the_chosen_units(tmp_path):
    study = STUDY.replace('{ start = "500 mm", stop = "600 mm", num = 3 }', '"500 mm"') + UNITS
    (tmp_path / "inch.toml").write_text(study)
    command = ("coverage", "inch.toml")
    plain = json.loads(run(*command, "--units", "declared", "--json", cwd=tmp_path).stdout)
    shown = json.loads(run(*command, "--units", "angle=rad", "--json", "-o", tmp_path / "c.svg", cwd=tmp_path).stdout)
    for row, other in zip(shown["cranks"], plain["cranks"], strict=True):
        for name, size in (("crank [in]", INCH), ("coupler_max [in]", INCH), ("swing_max [rad]", math.degrees(1))):
            assert row[name] * size == pytest.approx(other[name.partition(" ")[0]], rel=1e-15)
    assert np.degrees(shown["total [rad]"]) == pytest.approx(plain["total"], rel=1e-15)
    assert np.degrees(shown["gaps [rad]"]).ravel() == pytest.approx(np.ravel(plain["gaps"]), rel=1e-13)
    table = run(*command, cwd=tmp_path).stdout
    assert re.search(r"^ +in +in +in +deg +deg +deg$", table, re.MULTILINE)
    assert "coupler length [in]" in (tmp_path / "c.svg").read_text()
    assert run(*command, "--units", "length=deg", cwd=tmp_path, code=2).stderr.startswith("error: --units length=deg: ")


def test_the_figure_of_coverage_is_in_the_chosen_units():
    declared = explore.coverage([50, 60], rocker=500, ground=700, coupler=(600, 800))
    figures = [charts.coverage_chart(shown) for shown in (declared, declared.in_units(ShownUnits({"length": "in"})))]
    first, second = (figure.axes[0].get_lines()[0].get_xydata() for figure in figures)
    np.testing.assert_allclose(second * [INCH, 1.0], first, rtol=1e-15)
    assert [figure.axes[1].get_xlabel() for figure in figures] == ["crank length [mm]", "crank length [in]"]
    assert "rocker 19.685 in" in figures[1].get_suptitle()


@pytest.mark.parametrize(
    ("entry", "unit", "shown"),
    [
        ('"60 rpm"', "rpm", 60.0),
        ('["60 rpm", "80 rpm"]', "rpm", 60.0),
        ('{ start = "60 rpm", stop = "80 rpm", num = 2 }', "rpm", 60.0),
        ('["60 rpm", 9.0]', "rad/s", 60.0 * RPM),
        ('["60 rpm", "2 Hz"]', "rad/s", 60.0 * RPM),
        ("6.0", "rad/s", 6.0),
    ],
)
def test_a_speed_given_in_rpm_is_shown_in_rpm(entry, unit, shown, tmp_path):
    """And nothing else: velocities of the output are in the declared unit, and so is the file."""
    results = sweep_text(tmp_path, STUDY.replace('"60 rpm"', entry))
    assert results.units["speed"] == "rad/s"
    own = open_shown(tmp_path / "study.h5", None)
    assert (own.units["speed"], own.units["mean"]) == (unit, "rad/s")
    assert own.design(0)["speed"] == pytest.approx(shown, rel=1e-15)
    for texts, expected in ((["declared"], "rad/s"), (["speed=Hz"], "Hz"), (["speed=rad/s"], "rad/s")):
        assert open_shown(tmp_path / "study.h5", texts).units["speed"] == expected


def test_a_speed_that_shapes_the_motion_is_shown_in_rpm_too(tmp_path):
    study = explore.Study(
        mechanism="variable-crank",
        parameters={"rod": 600, "slider_speed": 800, "speed": "100 rpm", "reversal_time": 0.07},
        metrics=["stroke"],
    )
    explore.sweep(study, tmp_path / "study.h5")
    own = open_shown(tmp_path / "study.h5", None)
    assert (own.units["speed"], own.design(0)["speed"]) == ("rpm", pytest.approx(100, rel=1e-15))


def test_simulate_tells_the_speed_of_a_study_in_rpm(tmp_path):
    """As all commands do where the study gives it so; bare numbers of --set are in what is told, as those of tune."""
    text = 'mechanism = "crank-rocker"\n[parameters]\ncrank = 100\ncoupler = 1083.4236\nrocker = 541.7118\n'
    (tmp_path / "turning.toml").write_text(text + 'ground = 691.7118\nspeed = "60 rpm"\n')
    (tmp_path / "plain.toml").write_text(text + "ground = 691.7118\nspeed = 6\n")
    for name, words, end in (
        ("turning", (), "speed = 60 rpm"),
        ("turning", ("--units", "declared"), "speed = 6.283185307"),
        ("turning", ("--set", "speed=6"), "speed = 60 rpm, but speed = 6 rpm"),
        ("turning", ("--set", "speed=6", "--units", "declared"), "speed = 6.283185307, but speed = 6"),
        ("plain", (), "speed = 6"),
    ):
        told = run("simulate", f"{name}.toml", "--angles", 1, *words, cwd=tmp_path).stderr.splitlines()
        assert told[0].startswith("design 0 of 1: crank = 100, ")
        assert told[0].endswith(end)
