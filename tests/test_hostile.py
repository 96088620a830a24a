"""Hostile names, files and headers: one line of error, a known exit code, nothing written or executed, no hang."""

import ast
import os
import shutil
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
from command_line import assert_refused, call, succeed
from store_files import unseal
from studies import GOOD, swept

import explore

PACKAGE = Path(explore.__file__).parent


# --- no code in a file is executed -----------------------------------------------------------------------------------


def syntax_trees():
    for path in sorted(PACKAGE.rglob("*.py")):
        yield path.relative_to(PACKAGE).as_posix(), ast.parse(path.read_text(encoding="utf-8"))


def test_no_module_that_deserialises_objects_is_imported():
    forbidden = {"pickle", "cPickle", "dill", "cloudpickle", "marshal", "shelve", "yaml", "joblib", "code", "runpy"}
    violations = []
    for file, tree in syntax_trees():
        for node in ast.walk(tree):
            modules = []
            if isinstance(node, ast.Import):
                modules = [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom):
                modules = [node.module or ""]
            violations += [(file, module) for module in modules if module.partition(".")[0] in forbidden]
    assert violations == []


def test_no_call_executes_text():
    violations = []
    for file, tree in syntax_trees():
        for node in ast.walk(tree):
            if not isinstance(node, ast.Call):
                continue
            name = ast.unparse(node.func)
            # programs of certificates: no name of a table is in their text, which a test of them reads
            is_program = (file, ast.unparse(node)) == (
                "analysis/certifying/ball_programs.py",
                "exec(text, _NAMES, found)",
            )
            if name in ("eval", "exec", "compile", "__import__", "os.system", "os.popen") and not is_program:
                violations.append((file, node.lineno, name))
            reads_text = name.endswith(("read_pickle", ".query", ".eval")) and not name.startswith("cKDTree(")
            if name.split(".")[0] in ("subprocess", "pty") or reads_text:
                violations.append((file, node.lineno, name))
            # ffmpeg, and processes of the service: a list of words, no shell
            if str(file) in ("figures/exporting/frames.py", "service/runner.py") and name in (
                "subprocess.run", "subprocess.Popen",
            ):  # fmt: skip
                assert ast.unparse(node.args[0]) == "command"
                assert "shell" not in {keyword.arg for keyword in node.keywords}
                violations.pop()
            if name.endswith(("np.load", "numpy.load")):
                keywords = {keyword.arg: ast.unparse(keyword.value) for keyword in node.keywords}
                if keywords.get("allow_pickle", "False") != "False":
                    violations.append((file, node.lineno, "load with pickles"))
    assert violations == []


def names_in(folder):
    """Sorted names of the entries of a folder."""
    return sorted(path.name for path in folder.iterdir())


# --- names -----------------------------------------------------------------------------------------------------------

NAMES = [
    "with space", "ω–é", "it's", 'say "hi"', "[bold]x[bold]", "[red]", "{x}", "%s", "$HOME", "`id`", "a;b", "-dash",
    "--help", "~", "back\\slash", "tab\there", "esc\x1b[31m", "new\nline", "\u202eright to left", "bad\udcff", "*?",
    "y" * 200,
]  # fmt: skip


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """An empty current folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


#: A finished sweep of one design.
sound = swept(GOOD, "sound", give=lambda results: results.path)


@pytest.mark.parametrize("name", NAMES)
def test_any_file_name_works(folder, sound, name):
    study, results = f"./{name}.toml", f"./{name}/{name}.h5"
    Path(study).write_text(GOOD)
    assert call("sweep", study, "--dry-run")[0] == 0
    Path(name).mkdir(exist_ok=True)
    shutil.copy(sound, results)
    for options in (["show"], ["show", "--json"], ["show", "--design", 0]):
        out, err = succeed(*options, results)
        assert "\x1b" not in out + err
        if name.startswith("[") and "--design" in options:
            assert name in out, "brackets are not taken for markup"
    code, _, err = call("sweep", study, "-o", results)
    assert (code, "is complete already: 1 design\n" in err) == (0, True), err
    Path(study).write_text(GOOD.replace("crank ", "crnak "))
    code, _, err = call("sweep", study)
    assert code == 2
    assert ".toml:3: parameters.crnak: unknown parameter; did you mean 'crank'?" in err
    assert names_in(folder) == sorted([name, f"{name}.toml"])


#: The commands that show a results file, in one process.
SHOWN = """
import sys
from explore.cli import main
name = sys.argv[1]
for options in ([], ["--json"], ["--design", "0"]):
    sys.argv = ["explore", "show", name, *options]
    try:
        main()
    except SystemExit as ending:
        assert not ending.code, ending.code
"""


@pytest.mark.parametrize("encoding", ["ascii:strict", "utf-8:strict", "cp1252:strict"])
def test_any_terminal_encoding_works(folder, sound, encoding):
    shutil.copy(sound, "bad\udcff ω.h5")
    environment = os.environ | {"PYTHONIOENCODING": encoding}
    command = [sys.executable, "-c", SHOWN, "bad\udcff ω.h5"]
    done = subprocess.run(command, capture_output=True, env=environment, timeout=240, check=False)
    assert (done.stderr, done.returncode) == (b"", 0)


@pytest.mark.parametrize("stream", [1, 2])
def test_closed_streams(folder, stream):
    command = f"{sys.executable} -m explore show missing.h5 {stream}>&-"
    done = subprocess.run(["bash", "-c", command], capture_output=True, text=True, timeout=240, check=False)
    assert done.returncode == 1
    assert done.stderr in ("", "error: missing.h5 does not exist; sweep its study first\n")


# --- odd files --------------------------------------------------------------------------------------------------------


@pytest.fixture
def odd_files(folder, sound):
    """A folder with entries that are not regular files, and with broken files."""
    (folder / "study.toml").write_text(GOOD)
    shutil.copy(sound, "sound.h5")
    os.mkfifo("fifo")
    Path("dir").mkdir()
    Path("empty").touch()
    Path("loop").symlink_to("loop")
    Path("dangling").symlink_to("nowhere")
    Path("byte").write_bytes(b"\x89")
    return folder


WITHOUT_END = ["fifo", "/dev/zero", "/dev/null", "/dev/tty"]


@pytest.mark.parametrize("name", [*WITHOUT_END, "dir", "loop", "dangling", "x" * 300, "d/" * 3000 + "x", ".", ""])
def test_studies_that_are_no_files(odd_files, name):
    before = snapshot(odd_files)
    for command in (["sweep", name], ["sweep", name, "--dry-run"], ["simulate", name or "."]):
        assert_refused(call(*command), 2)
    assert snapshot(odd_files) == before


@pytest.mark.parametrize(
    "name", [*WITHOUT_END, "dir", "empty", "byte", "loop", "dangling", "x" * 300, "d/" * 3000, "."]
)
def test_results_that_are_no_files(odd_files, name):
    before = snapshot(odd_files)
    for command in (["show", name], ["rank", name], ["show", name, "--design", "0"]):
        assert_refused(call(*command), 1)
    assert snapshot(odd_files) == before


@pytest.mark.parametrize(
    "name", [*WITHOUT_END, "dir", "empty", "byte", "byte/x.h5", "/proc/x.h5", "/proc/x/y.h5", ".", ""]
)
@pytest.mark.parametrize("extra", [[], ["--restart"]])
def test_sweeps_into_what_is_no_results_file(odd_files, name, extra):
    before = snapshot(odd_files)
    assert_refused(call("sweep", "study.toml", "-o", name, *extra), 1, "another")
    assert snapshot(odd_files) == before


def test_a_name_that_is_too_long(odd_files):
    assert_refused(call("sweep", "study.toml", "-o", "x" * 300), 1, "File name too long")


def snapshot(folder):
    """Names and contents of everything in a folder."""
    return {
        path.relative_to(folder).as_posix(): path.read_bytes() if path.is_file() else path.lstat().st_mode
        for path in folder.rglob("*")
    }


def test_a_study_larger_than_any_is_not_read(folder):
    with Path("huge.toml").open("wb") as file:
        file.truncate(1 << 40)
    assert_refused(call("sweep", "huge.toml"), 2, "huge.toml: has 1,099,511,627,776 bytes")


@pytest.mark.parametrize("name", ["fifo", "/dev/zero"])
def test_endless_inputs_end_as_processes_too(odd_files, name):
    """In a process with limited memory, 4 GiB: an endless device must not be read at all.

    The shell sets the limit: a function before the process starts needs a fork, of which other libraries here warn.
    """
    limited = ["sh", "-c", 'ulimit -v 4194304 && exec "$0" "$@"', sys.executable, "-m", "explore"]
    for command in (["sweep", name], ["show", name]):
        done = subprocess.run([*limited, *command], capture_output=True, text=True, timeout=240, check=False)
        assert_refused((done.returncode, done.stdout, done.stderr), 2 if command[0] == "sweep" else 1, name)


def test_links_and_dots_lead_to_the_same_study_and_results(odd_files):
    Path("link.toml").symlink_to("study.toml")
    Path("link.h5").symlink_to("sound.h5")
    Path("folder").symlink_to("dir")
    shutil.copy("sound.h5", "dir/inner.h5")
    before = Path("sound.h5").read_bytes()
    for study in ("link.toml", "dir/../study.toml", "folder/../study.toml", "./study.toml"):
        for results in ("link.h5", "dir/../sound.h5", "folder/inner.h5"):
            code, _, err = call("sweep", study, "-o", results)
            assert (code, "complete already" in err) == (0, True), err
    assert call("show", "link.h5")[0] == 0
    assert Path("sound.h5").read_bytes() == before
    assert Path("link.h5").is_symlink()
    assert_refused(call("sweep", "study.toml", "-o", "link.toml"), 2, "the study itself")


@pytest.mark.parametrize("link", [None, os.symlink, os.link])
def test_inputs_are_never_overwritten(odd_files, link):
    for name, command in (("sound.h5", ["rank", "sound.h5"]), ("study.toml", ["simulate", "study.toml"])):
        before, output = Path(name).read_bytes(), name
        if link:
            output = f"link to {name}"
            link(name, output)
        assert_refused(call(*command, "-o", output), 2, "itself; name another file")
        assert Path(name).read_bytes() == before


# --- headers ---------------------------------------------------------------------------------------------------------


def replies(worker, path):
    """Exit code, stdout and stderr of the commands that read a results file."""
    answers = worker.run(["show", str(path)], ["show", str(path), "--design", "0"], ["rank", str(path)])
    return [(answer["code"], answer["out"], answer["err"]) for answer in answers]


def recreate(file, name, **options):
    """Replace a column by one created with these options."""
    del file["designs"][name]
    return file["designs"].create_dataset(name, **options)


def huge_file(file):
    for name in list(file["designs"]):
        recreate(file, name, shape=(2**60,), dtype=file["designs"][name].dtype, fill_time="never")
    file.attrs["n_designs"] = 2**60


def virtual(file):
    layout = h5py.VirtualLayout((1,), "<f8")
    layout[:] = h5py.VirtualSource("/etc/passwd", "x", (1,))
    del file["designs/crank"]
    file["designs"].create_virtual_dataset("crank", layout)


def nested_groups(file):
    group = file
    for _ in range(1000):
        group = group.create_group("g")


def link(name, to):
    def change(file):
        if name in file:
            del file[name]
        file[name] = to

    return change


REFUSED = {
    "2^60 designs": huge_file,
    "2^60 designs in one column": lambda file: recreate(file, "crank", shape=(2**60,), dtype="<f8", fill_time="never"),
    "2^60 designs as a number only": lambda file: file.attrs.modify("n_designs", 2**60),
    "2^60 blocks": lambda file: file.attrs.modify("block_size", -(2**60)),
    "a virtual column": virtual,
    "a column in /etc/passwd": lambda file: recreate(
        file, "crank", shape=(1,), dtype="<f8", external=[("/etc/passwd", 0, 8)]
    ),
    "a column behind an external link": link("designs/crank", h5py.ExternalLink("/etc/passwd", "/x")),
    "columns behind a loop": link("designs", h5py.SoftLink("/designs")),
    "columns behind two loops": link("frame", h5py.SoftLink("/designs/frame/frame")),
    "texts behind a link": link("study", h5py.ExternalLink("other.h5", "/")),
    "a column of references": lambda file: recreate(file, "crank", shape=(1,), dtype=h5py.ref_dtype),
    "a column of texts": lambda file: recreate(file, "crank", data=["import os"], dtype=h5py.string_dtype()),
    "a column of records": lambda file: recreate(file, "crank", shape=(1,), dtype=[("a", "<i4"), ("b", "<i4")]),
    "a column of strange floats": lambda file: recreate(file, "crank", shape=(1,), dtype=">f8"),
    "a column of two axes": lambda file: recreate(file, "crank", shape=(1, 1), dtype="<f8"),
    "a column that is a group": lambda file: (file.__delitem__("designs/crank"), file.create_group("designs/crank")),
}


@pytest.fixture(scope="module")
def altered(sound, tmp_path_factory):
    """A function that makes a copy of the sound file with a change."""

    def alter(change):
        path = tmp_path_factory.mktemp("altered") / "altered.h5"
        shutil.copy(sound, path)
        with h5py.File(path, "r+", libver="latest", track_order=False) as file:
            change(file)
        return path

    return alter


@pytest.mark.parametrize("change", REFUSED.values(), ids=REFUSED)
def test_headers_that_are_refused(worker, altered, change):
    path = altered(change)
    before = path.read_bytes()
    for reply in replies(worker, path):
        assert_refused(reply, 1, "altered.h5 is damaged and cannot be read")
    assert path.read_bytes() == before
    assert names_in(path.parent) == ["altered.h5"]


def test_an_attribute_of_1_mb_is_refused(worker, sound, tmp_path):
    path = tmp_path / "altered.h5"
    with h5py.File(sound) as file, h5py.File(path, "w", libver="latest") as other:
        for name, value in file.attrs.items():
            other.attrs[name] = value
        other.attrs["config"] = np.bytes_(b"x" * 2**20)
    for reply in replies(worker, path):
        assert_refused(reply, 1, "attribute config is too long")


IGNORED = {
    "an attribute with texts of any length": lambda file: file.attrs.create("x", ["import os"] * 3),
    "an attribute with a reference": lambda file: file.attrs.create("x", file["designs"].ref, dtype=h5py.ref_dtype),
    "an attribute with lists": lambda file: file.attrs.create(
        "x", np.array([np.arange(3, dtype="i4"), None], dtype=object)[:1], dtype=h5py.vlen_dtype("i4")
    ),
    "an attribute with records": lambda file: file.attrs.create("x", np.zeros(2, [("a", "i4"), ("b", "S3")])),
    "an opaque attribute": lambda file: file.attrs.create("x", np.void(b"cos\nsystem\n(S'id'\ntR.")),
    "5000 attributes": lambda file: [file.attrs.create(f"x{k}", k) for k in range(5000)],
    "a thousand groups in one another": nested_groups,
    "a group in itself": lambda file: link("g/again", file.create_group("g"))(file),
    "a link to itself": link("loop", h5py.SoftLink("/loop")),
    "a link elsewhere": link("other", h5py.ExternalLink("/dev/zero", "/")),
    "a pickle": lambda file: file.create_dataset("pickle", data=np.void(b"cos\nsystem\n(S'touch run'\ntR.")),
    "a huge dataset": lambda file: file.create_dataset("huge", shape=(2**60,), dtype="f8", chunks=(2**20,)),
}


def test_an_empty_attribute_is_ignored(worker, altered):
    path = altered(lambda file: file.attrs.create("x", h5py.Empty("f8")))
    assert [reply[0] for reply in replies(worker, path)] == [0, 0, 0]


@pytest.mark.parametrize("change", IGNORED.values(), ids=IGNORED)
def test_additions_that_are_ignored(worker, sound, altered, change):
    path = altered(change)
    plain = [(code, out.replace(str(sound), str(path)).split(), err) for code, out, err in replies(worker, sound)]
    changed = [(code, out.split(), err) for code, out, err in replies(worker, path)]
    assert [reply[0] for reply in changed] == [0, 0, 0]
    assert [reply[2] for reply in changed] == [reply[2] for reply in plain]
    assert names_in(path.parent) == ["altered.h5"]


ESCAPE = "\x1b]0;owned\x07\x1b[2J"


def escapes(file):
    unseal(file)
    for name, dataset in file["designs"].items():
        for attribute in ("units", "long_name"):
            dataset.attrs[attribute] = np.bytes_(f"[bold]{name}{ESCAPE}".encode())
    file["designs/status"].attrs["labels"] = np.bytes_(b'{"0": "pending", "1": "ok\\u001b[2J"}')
    file.attrs["mechanism"] = np.bytes_(f"four{ESCAPE}".encode())


def test_texts_of_a_results_file_send_no_escape_sequences(worker, altered):
    path = altered(escapes)
    for code, out, err in replies(worker, path):
        assert code == 0, err
        assert not {"\x1b", "\x07"} & set(out + err)


def test_cut_at_the_boundaries_of_its_parts(worker, sound, tmp_path):
    whole = sound.read_bytes()
    with h5py.File(sound) as file:
        pieces = [*file["designs"].values(), file["progress/commit"]]
        offsets = [dataset.id.get_offset() for dataset in pieces] + [d.id.get_offset() + d.nbytes for d in pieces]
    lengths = {0, 1, 7, 8, 9, 95, 96, 97, 511, 512, 513, 2048, 4096, len(whole) - 1}
    lengths |= {offset + more for offset in offsets for more in (-1, 0, 1)}
    path = tmp_path / "cut.h5"
    for length in sorted(length for length in lengths if length < len(whole)):
        path.write_bytes(whole[:length])
        for reply in replies(worker, path):
            assert_refused(reply, 1, "cut.h5 is")


def test_opening_a_file_of_forged_size_takes_little_memory(altered):
    """Peak memory of a process that opens the file of 2^60 designs, against one that opens none."""
    script = (
        "import resource, sys, explore\nfrom explore.results.store.open_results import open_results\n"
        "try: open_results(sys.argv[1])\nexcept explore.ExploreError: pass\n"
        "print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)"
    )
    peaks = [
        int(subprocess.run([sys.executable, "-c", script, name], capture_output=True, text=True, check=True).stdout)
        for name in ("missing.h5", str(altered(huge_file)))
    ]
    assert peaks[1] - peaks[0] < 50_000  # kB
