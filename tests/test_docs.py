"""The pages under docs: every Python block runs, and prints what the page says that it prints."""

import importlib
import re
import shlex
import time
import warnings
from pathlib import Path

import pytest
import typer
from command_line import call, run, succeed
from served import Served

import explore
from explore.cli.application import app
from explore.cli.commands.plot import KINDS
from explore.service.station import COMPILING

ROOT = Path(__file__).parents[1]
#: A Python block and, where its output is the same on every machine, the text block that follows it.
BLOCKS = re.compile(r"^```python\n(.*?)^```\n(?:\n```text\n(.*?)^```)?", re.MULTILINE | re.DOTALL)

#: Commands and what they print, in a block of the tutorial.
COMMANDS = re.compile(r"^\$ explore ((?:.*\\\n)*.*)\n((?:(?!\$ |```).*\n)*)", re.MULTILINE)
#: Times of commands, which differ between machines.
TIMES = re.compile(r"in [\d.]+ s\b(?: \([\d,]+/s\))?|about [\d.]+ s of computing")
#: Line that stands for output left out.
LEFT_OUT = re.compile(r"^…$", re.MULTILINE)
#: Numbers with so many digits that the last ones differ between processors.
LONG_NUMBER = re.compile(r"\d+\.\d{11,}")


def comparable(text):
    """The text without times, long numbers in twelve digits."""
    return LONG_NUMBER.sub(lambda number: f"{float(number[0]):.12g}", TIMES.sub("", text))


def ends_with(text, expected):
    """Whether a command's output ends with what a page shows; slow machines print lines of progress first."""
    parts = [re.escape(part) for part in LEFT_OUT.split(comparable(expected).rstrip())]
    return re.search(".*".join(parts) + r"\s*\Z", comparable(text), re.DOTALL)


def run_page(name, capsys, names=None):
    """Run the blocks of a page one after the other in one namespace."""
    names = {} if names is None else names
    blocks = BLOCKS.findall((ROOT / "docs" / name).read_text(encoding="utf-8"))
    assert blocks, f"{name} has no Python blocks"
    for source, expected in blocks:
        capsys.readouterr()
        exec(compile(source, name, "exec"), names)  # our own pages
        printed = capsys.readouterr().out
        if expected:
            assert printed.split() == expected.split(), f"{name}:\n{source}"


@pytest.mark.parametrize(
    "page",
    [
        "physics.md",
        "published-study.md",
        "published-simulation.md",
        "methods.md",
        "gears.md",
        "loads.md",
        "variable-crank.md",
    ],
)
def test_page_is_true(page, capsys):
    run_page(page, capsys)


def test_mechanisms_shows_the_simple_slider():
    shown = [source for source, _ in BLOCKS.findall((ROOT / "docs/mechanisms.md").read_text(encoding="utf-8"))]
    source = (ROOT / "tests/simple_slider.py").read_text(encoding="utf-8")
    assert len(shown) == 4
    assert [block for block in shown if block not in source] == []


def test_sweeps_is_true(tmp_path, monkeypatch, capsys):
    (tmp_path / "configs").symlink_to(ROOT / "configs")
    monkeypatch.chdir(tmp_path)
    run_page("sweeps.md", capsys)


def test_the_readme_shows_feasible_designs(tmp_path, monkeypatch, capsys):
    (tmp_path / "results").mkdir()
    monkeypatch.chdir(tmp_path)
    names = {}
    with warnings.catch_warnings():
        warnings.simplefilter("error", explore.NothingFeasibleWarning)
        run_page("../README.md", capsys, names)
    assert names["results"].counts["ok"] == names["results"].n_studied
    assert len(explore.rank(names["results"], objectives=["cv", "transmission_angle_min:max"])) > 10


def test_results_format_is_true(tmp_path, monkeypatch, capsys):
    for package in ("h5netcdf", "tables", "xarray"):
        pytest.importorskip(package)
    (tmp_path / "configs").symlink_to(ROOT / "configs")
    (tmp_path / "results").mkdir()
    monkeypatch.chdir(tmp_path)
    explore.sweep(explore.load_study("configs/grid.toml"), "results/grid.h5")
    run_page("results-format.md", capsys)


def test_ranking_is_true(tmp_path, monkeypatch, capsys):
    """The blocks run; each command prints what stands below it, on both streams."""
    (tmp_path / "results").mkdir()
    monkeypatch.chdir(tmp_path)
    for name in ("grid", "published"):
        explore.sweep(explore.load_study(ROOT / f"configs/{name}.toml"), f"results/{name}.h5")
    run_page("ranking.md", capsys)
    page = (ROOT / "docs/ranking.md").read_text(encoding="utf-8")
    commands = re.findall(r"^```sh\nexplore ([^\n]*)\n```\n(?:\n```text\n(.*?)^```)?", page, re.MULTILINE | re.DOTALL)
    assert len(commands) == 5
    for command, expected in commands:
        out, err = succeed(*shlex.split(command))
        assert ends_with(err + out, expected), command


def test_refining_is_true(tmp_path, monkeypatch, capsys):
    """The commands run, on fewer designs, and polish prints the same cv; the Python block prints what it says."""
    (tmp_path / "configs").mkdir()
    (tmp_path / "results").mkdir()
    text = (ROOT / "configs/optimum.toml").read_text(encoding="utf-8").replace("1_000_000", "30_000")
    (tmp_path / "configs/optimum.toml").write_text(text, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    page = (ROOT / "docs/refine.md").read_text(encoding="utf-8")
    commands = [
        line for block in re.findall(r"^```sh\n(.*?)^```", page, re.MULTILINE | re.DOTALL) for line in block.split("\n")
    ]
    for line in filter(None, commands):
        out, _ = succeed(*shlex.split(line)[1:])
    assert "0.35391225" in out
    assert "0.35391225" in page
    run_page("refine.md", capsys)


def test_gallery_is_true(tmp_path, monkeypatch, capsys):
    """Each picture is that of the command above it, is there and is small; the Python block runs."""
    monkeypatch.syspath_prepend(ROOT / "docs")
    figures = importlib.import_module("figures")
    page = (ROOT / "docs/gallery.md").read_text(encoding="utf-8")
    shown = re.findall(r"^explore plot (.*)\n```\n\n!\[.+\]\(gallery/(.*)\.png\)$", page, re.MULTILINE)
    assert {name: command.split() for command, name in shown} == figures.GALLERY
    assert {arguments[0] for arguments in figures.GALLERY.values()} == set(KINDS)
    for name in figures.GALLERY:
        assert 0 < (ROOT / f"docs/gallery/{name}.png").stat().st_size <= figures.MAX_BYTES
    (tmp_path / "configs").symlink_to(ROOT / "configs")
    (tmp_path / "results").mkdir()
    monkeypatch.chdir(tmp_path)
    run_page("gallery.md", capsys)


def run_commands(page, folder, monkeypatch):
    """Run the commands of a page, or of its text, one after the other, which must print what it says; their names."""
    (folder / "configs").symlink_to(ROOT / "configs")
    (folder / "results").mkdir()
    monkeypatch.chdir(folder)
    text = (ROOT / "docs" / page).read_text(encoding="utf-8") if page.endswith(".md") else page
    commands = COMMANDS.findall(text)
    for line, expected in commands:
        out, err = succeed(*shlex.split(line.replace("\\\n", " ")))
        assert ends_with(err + out, expected), line
    return {line.split()[0] for line, _ in commands}


def test_tutorial_of_the_service_is_true(tmp_path, monkeypatch):
    """The commands of both terminals, on the port that is free; a link for a colleague opens the service."""
    page = (ROOT / "docs/tutorial-service.md").read_text(encoding="utf-8")
    with Served(tmp_path / "served") as server:
        connection = ("--server", server.url, "--token-file", str(tmp_path / "served/token"))
        # the time is told once the service has its kernels
        for _ in range(600):
            if COMPILING not in "".join(call("submit", str(ROOT / "configs/grid.toml"), *connection, "--dry-run")[1:]):
                break
            time.sleep(0.2)
        page = page.replace("http://127.0.0.1:8765", server.url)
        assert run_commands(page, tmp_path, monkeypatch) == {"submit", "rank"}
        (form,) = re.findall(r"\*\*(Invite\s.*?)\*\*", page, re.DOTALL)
        with server.client() as client:
            assert f">{' '.join(form.split())}</h2>" in client.get(server.url).text
            link = client.post(f"{server.url}/api/links", json={"right": "read"}).json()["link"]
        assert re.fullmatch(rf"{server.url}/#token=[\w-]{{43}}", link)
        with server.browser(link.partition("=")[2]) as browser:
            assert browser.get("/api/session").json() == {"right": "read"}
            assert [job["name"] for job in browser.get("/api/jobs").json()["jobs"]] == ["grid"]
        assert server.stop() == 0


def test_formulas_of_sweeps_are_true(tmp_path, monkeypatch):
    """The commands print what the section says, and so do the mistakes in its study."""
    page = (ROOT / "docs/sweeps.md").read_text(encoding="utf-8")
    (section,) = re.findall(r"^## Metrics of your own\n(.*?)^## ", page, re.MULTILINE | re.DOTALL)
    (study,) = re.findall(r"^```toml\n(# own.toml\n.*?)^```", section, re.MULTILINE | re.DOTALL)
    (tmp_path / "own.toml").write_text(study)
    assert run_commands(section, tmp_path, monkeypatch) == {"sweep", "rank"}
    mistakes = (
        ("coupler + ground", "couplr + ground"),
        ("swing_angle / 2)", "swing_angle / 2 * pi / 180)"),
        ("rocker_velocity_peak_cycle / chord", "rocker_velocity_peak_cycle / haste"),
    )
    for right, wrong in mistakes:
        assert right in study
        study = study.replace(right, wrong)
    (tmp_path / "own.toml").write_text(study)
    code, _, err = call("sweep", "own.toml")
    assert (code, err.removeprefix("error: ")) == (2, section.split("```text\n")[1].split("```")[0])


@pytest.mark.parametrize(("page", "commands"), [
    ("test-rig.md", {"sweep", "rank", "coverage"}),
    ("slider-crank.md", {"sweep", "rank"}),
    ("coupler-points.md", {"sweep", "rank"}),
    ("tune.md", {"tune"}),
    ("sensitivity.md", {"sweep", "sensitivity"}),
])  # fmt: skip
def test_page_with_commands_is_true(tmp_path, monkeypatch, capsys, page, commands):
    assert run_commands(page, tmp_path, monkeypatch) == commands
    run_page(page, capsys)


def test_tolerance_is_true(tmp_path, monkeypatch, capsys):
    page = (ROOT / "docs/tolerance.md").read_text(encoding="utf-8")
    (study,) = re.findall(r"^```toml\n(.*?)^```", page, re.MULTILINE | re.DOTALL)
    (tmp_path / "study.toml").write_text(study, encoding="utf-8")
    (tmp_path / "results").mkdir()
    monkeypatch.chdir(tmp_path)
    explore.sweep(explore.load_study("study.toml"), "results/published_optimum.h5")
    ((line, expected),) = COMMANDS.findall(page)
    out, _ = succeed(*shlex.split(line))
    assert ends_with(out, expected)
    run_page("tolerance.md", capsys)


def test_certify_is_true(tmp_path, monkeypatch, capsys):
    page = (ROOT / "docs/certify.md").read_text(encoding="utf-8")
    (study,) = re.findall(r"^```toml\n# three-four-five.toml\n(.*?)^```", page, re.MULTILINE | re.DOTALL)
    (tmp_path / "three-four-five.toml").write_text(study)
    monkeypatch.chdir(tmp_path)
    assert call("sweep", "three-four-five.toml")[0] == 0
    code, out, _ = call("certify", "results/three-four-five.h5", "--design", "0", "--design", "1")
    assert code == 1
    shown = page[page.index("certified designs\n", page.index("--design 0")) :]
    assert shown.startswith(out[out.index("certified designs\n") :])
    run_page("certify.md", capsys)


def test_export_is_true(tmp_path, monkeypatch, capsys):
    """The commands print what the page says; so do the Python blocks after them; the pictures are the files written."""
    assert run_commands("export.md", tmp_path, monkeypatch) == {"sweep", "export"}
    run_page("export.md", capsys)
    number = re.compile(r"-?\d+\.\d+|-?\d+")
    for ending in (".svg", ".animated.svg"):
        drawn, shown = (path.read_text("utf-8") for path in (Path(f"feeder{ending}"), ROOT / f"docs/export{ending}"))
        assert number.sub("#", drawn) == number.sub("#", shown)
        values = [[float(value) for value in number.findall(text)] for text in (drawn, shown)]
        assert values[0] == pytest.approx(values[1], rel=0.0, abs=1.1e-6)  # six decimals, the last one rounded
    assert run("sweep", "feeder.toml", cwd=tmp_path).stderr.count("1 feasible") == 1


def test_tutorial_is_true(tmp_path, monkeypatch, capsys):
    """Its commands, one after the other, print what it says; so do its Python blocks after them."""
    page = (ROOT / "docs/tutorial.md").read_text(encoding="utf-8")
    (study,) = re.findall(r"^```toml\n# swing.toml\n(.*?)^```", page, re.MULTILINE | re.DOTALL)
    (tmp_path / "swing.toml").write_text(study)
    assert run_commands("tutorial.md", tmp_path, monkeypatch) == {"sweep", "rank", "plot", "simulate"}
    assert len(Path("motion.csv").read_text(encoding="utf-8").splitlines()) == 361
    assert Path("results/optimum-motion.png").exists()
    run_page("tutorial.md", capsys)


def run_blocks(page):
    """Run all blocks of a page in the working folder, one after the other: files and their changes, commands and what
    they print.
    """
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    for kind, block in re.findall(r"^```(\w+)\n(.*?)^```", text, re.MULTILINE | re.DOTALL):
        if kind == "toml":
            Path(block.split("\n")[0].removeprefix("# ")).write_text(block, encoding="utf-8")
        elif kind == "csv":
            name, _, rows = block.partition("\n")
            Path(name.removeprefix("# ")).write_text(rows, encoding="utf-8")
        elif kind == "diff":
            study = Path("wiper.toml").read_text(encoding="utf-8")
            for old, new in re.findall(r"^-(.*)\n\+(.*)$", block, re.MULTILINE):
                assert old in study
                study = study.replace(old, new)
            Path("wiper.toml").write_text(study, encoding="utf-8")
        elif kind == "sh":  # what a refinement prints may differ between processors
            for line in re.sub(r"--evaluations [\d_]+", "--evaluations 4000", block).splitlines():
                assert call(*shlex.split(line)[1:])[0] == 0, line
        elif kind == "text":
            for line, expected in COMMANDS.findall(block):
                out, err = succeed(*shlex.split(line.replace("\\\n", " ")))
                assert ends_with(err + out, expected), line


def test_tutorials_are_true(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    run_blocks("tutorials.md")


def test_linkages_is_true(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    run_blocks("linkages.md")
    assert Path("part.dxf").stat().st_size > 10_000
    run_page("linkages.md", capsys)


def test_synthesis_is_true(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    run_blocks("synthesis.md")
    assert Path("claw.dxf").stat().st_size > 10_000
    assert explore.load_study("claw-design.toml").request.mechanism.name == "crank-rocker"
    run_page("synthesis.md", capsys)


def test_tutorial_shows_its_design(monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "docs")
    drawn = importlib.import_module("figures").TUTORIAL
    page = (ROOT / "docs/tutorial.md").read_text(encoding="utf-8")
    assert f"$ explore plot {' '.join(drawn)}\n" in page
    assert "](tutorial-motion.png)" in page


def test_page_of_the_commands_says_what_their_help_says(monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "docs")
    group = typer.main.get_command(app)
    page = importlib.import_module("commands").commands_page()
    headings = re.split(r"^## (.*)\n", page, flags=re.MULTILINE)
    sections = dict(zip(headings[1::2], headings[2::2], strict=True))
    assert list(sections) == list(group.commands)
    for name, command in group.commands.items():
        said = [command.help, *(parameter.help for parameter in command.params)]
        said += [option for parameter in command.params for option in parameter.opts if option.startswith("-")]
        assert [text for text in said if text not in sections[name]] == []


@pytest.mark.parametrize("page", ["README.md", "docs/tutorial.md"])
def test_explore_is_typed_only_where_the_shell_knows_it(page):
    """Before their first command, the pages to begin with say how to put `explore` on the path."""
    text = (ROOT / page).read_text(encoding="utf-8")
    typed = re.search(r"^(?:\$ |\| `)?explore \w+[ `\n]", text, re.MULTILINE)
    assert typed
    assert "`. .venv/bin/activate`" in text[: typed.start()]
