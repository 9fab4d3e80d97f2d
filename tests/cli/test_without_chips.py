"""The command without the package of the virtual chips: one line says how to install it, and nothing else fails."""

from __future__ import annotations

import sys
from pathlib import Path
from types import ModuleType

import pytest
from wificnc import __version__
from wificnc.app import main
from wificnc.commands._chip import require_chips
from wificnc.errors import Exit, UserError
from wificnc.files import paths

PACKAGE = "wificnc_chips"


def run(*words: object) -> int:
    with pytest.raises(SystemExit) as ended:
        main([str(word) for word in words])
    return int(ended.value.code or 0)


@pytest.fixture
def no_chips(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its import fails, as where it is not installed."""
    for name in [name for name in sys.modules if name.partition(".")[0] == PACKAGE]:
        monkeypatch.delitem(sys.modules, name)

    class Missing:
        @staticmethod
        def find_spec(name: str, *_: object) -> None:
            if name.partition(".")[0] == PACKAGE:
                raise ModuleNotFoundError(f"No module named {name!r}", name=name)

    monkeypatch.setattr(sys, "meta_path", [Missing, *sys.meta_path])


@pytest.fixture(params=[True, False], ids=["checkout", "package"])
def install(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    """What is to be typed, in a checkout and elsewhere."""
    monkeypatch.setattr(paths, "IS_CHECKOUT", request.param)
    return "pip install -e emulators" if request.param else "pip install 'wificnc[chips]'"


@pytest.fixture
def job(tmp_path: Path) -> Path:
    path = tmp_path / "job.nc"
    path.write_text("G21G91\nG1X1F600\n")
    return path


@pytest.mark.usefixtures("no_chips")
@pytest.mark.parametrize(
    ("words", "what"),
    [
        (["sim", "JOB", "--board", "esp32-wroom32", "--on-chip"], "--on-chip"),
        (["serve", "--board", "esp32-wroom32", "--on-chip"], "--on-chip"),
        (["serve", "--board", "pic32mz2048efh100"], "the image of pic32mz2048efh100"),
        (["flash", "esp32-wroom32", "--verify-boot", "--from", "FOLDER"], "--verify-boot"),
    ],
)
def test_what_needs_them_says_how_to_install_them(
    words: list[str], what: str, job: Path, install: str, capsys: pytest.CaptureFixture[str]
) -> None:
    given = {"JOB": str(job), "FOLDER": str(job.parent)}
    assert run(*(given.get(word, word) for word in words)) == Exit.USAGE
    out, err = capsys.readouterr()
    assert (out, err) == ("", f"error: {what} needs the virtual chips: {install}\n")


@pytest.mark.usefixtures("no_chips")
def test_a_simulation_needs_none(job: Path) -> None:
    assert run("sim", job) == Exit.OK


def test_another_version_is_refused(install: str, monkeypatch: pytest.MonkeyPatch) -> None:
    other = ModuleType(PACKAGE)
    other.__dict__["__version__"] = "0.0.1"
    monkeypatch.setitem(sys.modules, PACKAGE, other)
    with pytest.raises(UserError, match=f"of version 0.0.1, and wificnc is {__version__}") as refused:
        require_chips("--on-chip")
    assert refused.value.hint == f"{install} --upgrade"


def test_a_fault_in_the_package_is_not_hidden(monkeypatch: pytest.MonkeyPatch) -> None:
    """An import that fails in it is a bug, or a missing requirement of its own."""

    class Broken:
        @staticmethod
        def find_spec(name: str, *_: object) -> None:
            if name == PACKAGE:
                raise ModuleNotFoundError("No module named 'numbers_of_others'", name="numbers_of_others")

    monkeypatch.delitem(sys.modules, PACKAGE, raising=False)
    monkeypatch.setattr(sys, "meta_path", [Broken, *sys.meta_path])
    with pytest.raises(ModuleNotFoundError, match="numbers_of_others"):
        require_chips("--on-chip")
