"""Every option that names a file to be written: what cannot be written is reported before anything is done."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
import rich_click as click
from cli_parameters import parameters
from click.testing import CliRunner
from wificnc.app import root
from wificnc.commands._output import OutputFile, OutputFolder
from wificnc.errors import UserError

try:
    import resource
except ImportError:
    resource = None  # type: ignore[assignment]
Cli = Callable[..., tuple[int, str, str]]

# The words before the name of the file; {job} is a G-code file, {dead} a controller that is not there.
FILES = {
    "dev pins": ("dev", "pins", "host", "-o"),
    "dev page": ("dev", "page", "-o"),
    "dev signing-key": ("dev", "signing-key", "-o"),
    "expand": ("expand", "{job}", "-o"),
    "sim --json": ("sim", "{job}", "--json"),
    "sim --plot": ("sim", "{job}", "--plot"),
    "sim --trace": ("sim", "{job}", "--trace"),
    "demo": ("demo", "-o"),
    "tune pattern": ("tune", "pattern", "-o"),
    "tune predict --plot": ("tune", "predict", "{job}", "--hz", "40", "--plot"),
    "boards show --picture": ("boards", "show", "host", "--picture"),
    "boards import -o": ("boards", "import", "{fluidnc}", "--machine", "machine.toml", "-o"),
    "boards import --machine": ("boards", "import", "{fluidnc}", "-o", "board.toml", "--machine"),
    "nvs build": ("nvs", "build", "baseline", "-o"),
    "nvs read": ("nvs", "read", "{job}", "-o"),
    "settings export": ("settings", "export", "--to", "tcp://127.0.0.1:1"),
    "linuxcnc component": ("linuxcnc", "component", "--out"),
}
FOLDERS = {
    "release": ("release", "--dry-run", "-o"),
    "linuxcnc init": ("linuxcnc", "init", "baseline", "--to", "192.0.2.1", "--out"),
}
FLUIDNC = Path(__file__).parents[1] / "fluidnc" / "router.yaml"
MAKES_FOLDERS = {"dev pins", "dev page", "dev signing-key"}  # build tools call them
SUFFIX = {
    "sim --plot": ".svg",
    "demo": ".svg",
    "sim --trace": ".csv",
    "boards show --picture": ".svg",
    "tune predict --plot": ".svg",
}
TO_STDOUT = (
    "dev pins",
    "dev page",
    "dev signing-key",
    "expand",
    "tune pattern",
    "sim --json",
    "nvs build",
    "linuxcnc component",
)
NOT_TO_STDOUT = (
    *("sim --plot", "tune predict --plot", "demo", "sim --trace", "boards show --picture"),
    *("boards import -o", "boards import --machine"),
    *FOLDERS,
)


@pytest.fixture
def words(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[str], list[str]]:
    """Of a case; the present folder is an empty one but for the job."""
    monkeypatch.chdir(tmp_path)
    job = tmp_path / "job.nc"
    job.write_text("G0X1\n")
    return lambda case: [word.format(job=job, fluidnc=FLUIDNC) for word in {**FILES, **FOLDERS}[case]]


def test_no_output_is_left_out_here() -> None:
    kinds = [(name, type(parameter.type)) for name, parameter in parameters(root)]
    files = [name for name, kind in kinds if kind is OutputFile]
    folders = [name for name, kind in kinds if kind is OutputFolder]
    assert len(files) == len(FILES) - 1  # linuxcnc component takes a file or its folder
    assert len(folders) == len(FOLDERS)
    named = {("-o", "--output"), ("--out",), ("--json", "--plot"), ("--picture",)}
    plain = [
        (name, parameter.opts)
        for name, parameter in parameters(root)
        if type(parameter.type) is click.Path and tuple(parameter.opts) in named
    ]
    assert plain == [("linuxcnc component", ["--out"])], "an output without its type"


@pytest.mark.parametrize("case", [case for case in FILES if case != "linuxcnc component"])
def test_a_folder_is_no_file(cli: Cli, words: Callable[[str], list[str]], case: str) -> None:
    folder = Path(f"folder{SUFFIX.get(case, '')}")
    folder.mkdir()
    code, out, err = cli(*words(case), folder)
    assert (code, out) == (2, "")
    assert "it is a folder" in " ".join(err.split())
    assert list(folder.iterdir()) == []


@pytest.mark.parametrize("case", FILES)
def test_a_missing_folder(cli: Cli, words: Callable[[str], list[str]], case: str) -> None:
    path = Path("missing") / "deeper" / f"file{SUFFIX.get(case, '')}"
    code, _, err = cli(*words(case), path)
    if case in MAKES_FOLDERS:
        assert code == 0 and path.is_file()
        return
    assert code == 2 and "folder not found: missing/deeper" in " ".join(err.replace("│", " ").split())
    assert not Path("missing").exists()


@pytest.mark.parametrize("case", [*FILES, *FOLDERS])
def test_a_file_in_place_of_the_folder(cli: Cli, words: Callable[[str], list[str]], case: str) -> None:
    Path("user.txt").write_text("mine")
    code, _, err = cli(*words(case), Path("user.txt") / f"file{SUFFIX.get(case, '')}")
    assert code == 2 and "user.txt is not a folder" in " ".join(err.replace("│", " ").split())
    assert Path("user.txt").read_text() == "mine"


@pytest.mark.parametrize("case", FILES)
def test_write_protected(
    cli: Cli, words: Callable[[str], list[str]], case: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = Path("protected")
    folder.mkdir(mode=0o500)
    if os.geteuid() == 0:  # who may write everywhere
        may = os.access
        monkeypatch.setattr(os, "access", lambda path, mode: mode != os.W_OK and may(path, mode))
    code, _, err = cli(*words(case), folder / f"file{SUFFIX.get(case, '')}")
    assert code == 2 and "write-protected" in err


@pytest.mark.parametrize("case", FILES)
def test_a_file_system_that_refuses(cli: Cli, words: Callable[[str], list[str]], case: str) -> None:
    """What cannot be known before: nothing can be made in /proc, not even by root."""
    if not Path("/proc/self").is_dir():
        pytest.skip("there is no /proc")
    before = set(Path().iterdir())
    code, _, err = cli(*words(case), f"/proc/wificnc{SUFFIX.get(case, '')}")
    assert code in (1, 2, 4, 6) and "Traceback" not in err and len(err) < 1000
    assert set(Path().iterdir()) == before


# The words before an output that is also read, or written twice; {0} is that file, {other} a second name of it.
READ_OR_TWICE = {
    "expand": ("expand", "{0}", "-o"),
    "sim --json": ("sim", "{0}", "--json"),
    "sim --json before it": ("sim", "--json", "{0}", "{other}", "--trace"),
    "sim --machine": ("sim", "job.nc", "--machine", "{other}", "--json"),
    "check's board": ("sim", "job.nc", "--board", "{0}", "--json"),
    "boards import -o": ("boards", "import", "{0}", "-o"),
    "boards import --machine": ("boards", "import", "{0}", "-o", "board.toml", "--machine"),
    "boards import, both": ("boards", "import", str(FLUIDNC), "-o", "{0}", "--machine"),
    "nvs build": ("nvs", "build", "{0}", "-o"),
    "nvs build --board": ("nvs", "build", "baseline", "--board", "{other}", "-o"),
    "nvs read": ("nvs", "read", "{0}", "-o"),
}


@pytest.mark.parametrize("case", READ_OR_TWICE)
@pytest.mark.parametrize("named", ["alike", "otherwise", "by a link"])
def test_what_is_read_is_not_written_over(cli: Cli, words: Callable[[str], list[str]], case: str, named: str) -> None:
    words("expand")
    Path("mine.csv").write_text("G0X1\n")
    Path("link.csv").symlink_to("mine.csv")
    name = {"alike": "mine.csv", "otherwise": "../" + Path.cwd().name + "/mine.csv", "by a link": "link.csv"}[named]
    before = sorted(Path().iterdir())
    argv = [word.format("mine.csv", other="./mine.csv") for word in READ_OR_TWICE[case]]
    code, out, err = cli(*argv, name)
    assert (code, out) == (2, "") and "name another file" in " ".join(err.split())
    assert Path("mine.csv").read_text() == "G0X1\n" and sorted(Path().iterdir()) == before


def test_two_new_outputs_are_two_files(cli: Cli, words: Callable[[str], list[str]]) -> None:
    code, _, err = cli(*words("boards import -o")[:3], "-o", "new.toml", "--machine", "./new.toml")
    assert code == 2 and "name another file" in " ".join(err.split()) and not Path("new.toml").exists()


@pytest.mark.parametrize("case", TO_STDOUT)
def test_a_dash_is_stdout(cli: Cli, words: Callable[[str], list[str]], case: str, tmp_path: Path) -> None:
    if case == "nvs build":
        pytest.importorskip("esp_idf_nvs_partition_gen")
    code, out, _ = cli(*words(case), "-")
    assert code == 0 and out != ""
    assert not Path("-").exists()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["job.nc"]


def test_what_goes_to_stdout_is_what_goes_to_a_file(cli: Cli, words: Callable[[str], list[str]]) -> None:
    for case in ("dev pins", "expand", "linuxcnc component"):
        _, out, _ = cli(*words(case), "-")
        cli(*words(case), "file.txt")
        assert out == Path("file.txt").read_text() != ""
        Path("file.txt").unlink()
    _, out, _ = cli(*words("sim --json"), "-")
    assert json.loads(out)["lines"] == 1


@pytest.mark.parametrize("case", NOT_TO_STDOUT)
def test_what_cannot_go_to_stdout(cli: Cli, words: Callable[[str], list[str]], case: str, tmp_path: Path) -> None:
    code, out, err = cli(*words(case), "-")
    assert (code, out) == (2, "") and "- is stdout" in " ".join(err.replace("│", " ").split())
    assert sorted(path.name for path in tmp_path.iterdir()) == ["job.nc"]


WHOLE = {
    "expand": ("expand", "{job}", "-o", "out.nc"),
    "picture": ("boards", "show", "host", "--picture", "out.svg"),
    "png": ("boards", "show", "host", "--picture", "out.png"),
    "json": ("sim", "{job}", "--json", "out.json"),
    "component": ("linuxcnc", "component", "--out", "out.c"),
}


@pytest.mark.skipif(resource is None, reason="Windows has no such limit")
@pytest.mark.parametrize("words", WHOLE.values(), ids=WHOLE)
def test_a_full_disk_leaves_no_half_of_a_file(
    words: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The size of files is limited instead, which fails at the same write."""
    monkeypatch.chdir(tmp_path)
    Path("job.nc").write_text("G21\n" * 500)
    monkeypatch.setattr(sys, "dont_write_bytecode", True)  # half of a module's would stay
    _, most = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (500, most))
    try:
        done = CliRunner().invoke(root, [word.format(job="job.nc") for word in words])
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (most, most))
    assert isinstance(done.exception, UserError) and "File too large" in done.exception.message
    assert [path.name for path in tmp_path.iterdir()] == ["job.nc"]
