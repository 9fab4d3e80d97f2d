"""`wificnc build`, and the Makefile and CI files around it."""

from __future__ import annotations

import importlib.util
import shutil
import subprocess
from pathlib import Path

import pytest
from wificnc.app import main
from wificnc.build.mips import COMPILER
from wificnc.build.pic32mz import FLASH_BUDGET, RAM_BUDGET
from wificnc.errors import Exit

ROOT = Path(__file__).resolve().parents[2]


def test_build_host_says_what_it_made(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        main(["build", "host"])
    said = capsys.readouterr()
    assert caught.value.code == Exit.OK and said.out == ""
    for word in ("compiler", "sources", "library", "core RAM", "of 196,608 bytes"):
        assert word in said.err


def test_other_board_is_honest(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        main(["build", "host-gantry"])
    assert caught.value.code == Exit.BUILD
    assert "board host-gantry is this computer: it has no firmware" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("pic32mz2048efh100", "--debug"), "pic32mz2048efh100 has one kind of build: --debug has no effect on it"),
        (("esp32s3-zero", "--variant", "asan"), "--variant is for the simulator, and esp32s3-zero is a board"),
        (("host", "--release", "--variant", "debug"), "--release and --variant debug exclude each other"),
    ],
)
def test_kinds_that_mean_nothing_are_refused(
    words: tuple[str, ...], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as caught:
        main(["build", *words])
    assert caught.value.code == Exit.USAGE
    assert said in " ".join(capsys.readouterr().err.split())


def test_debug_of_the_host_is_its_variant(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[str] = []
    monkeypatch.setattr("wificnc.commands.build.build_host", asked.append)
    monkeypatch.setattr("wificnc.commands.build.show", lambda *_: None)
    for words in (["--debug"], ["--release"], [], ["--variant", "asan"], ["--debug", "--variant", "debug"]):
        with pytest.raises(SystemExit):
            main(["build", "host", *words])
    assert asked == ["debug", "release", "release", "asan", "debug"]


@pytest.mark.slow
def test_build_pic32mz_says_what_it_made(capsys: pytest.CaptureFixture[str]) -> None:
    if shutil.which(COMPILER) is None:
        pytest.skip(f"{COMPILER} is not installed")
    with pytest.raises(SystemExit) as caught:
        main(["build", "pic32mz2048efh100"])
    said = capsys.readouterr()
    assert caught.value.code == Exit.OK and said.out == ""
    for word in (
        "compiler",
        "sources",
        f"of the budget of {FLASH_BUDGET:,}",
        f"of the budget of {RAM_BUDGET:,}",
        "wificnc.hex",
    ):
        assert word in said.err


def test_build_pic32mz_without_its_compiler(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setattr(importlib.util, "find_spec", lambda *_: None)
    with pytest.raises(SystemExit) as caught:
        main(["build", "pic32mz2048efh100"])
    assert caught.value.code == Exit.BUILD
    said = capsys.readouterr().err
    assert "apt-get install gcc-mipsel-linux-gnu" in said and "pip install ziglang" in said


@pytest.mark.parametrize("board", ["host", "esp32s3-devkitc"])
def test_cc_is_of_a_pic32mz(board: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        main(["build", board, "--cc", "zig"])
    assert caught.value.code == Exit.USAGE and "--cc is for a PIC32MZ only" in capsys.readouterr().err


@pytest.mark.skipif(shutil.which("make") is None, reason="make is not installed")
@pytest.mark.parametrize("target", ["demo", "test", "lint", "bench", "clean"])
def test_make_help_names_every_target(target: str) -> None:
    run = subprocess.run(["make", "-s", "-C", str(ROOT)], capture_output=True, text=True, check=True)
    assert f"make {target} " in run.stdout


@pytest.mark.slow
def test_demo_simulates_and_draws(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    picture = tmp_path / "demo.png"
    with pytest.raises(SystemExit) as caught:
        main(["demo", "-o", str(picture)])
    assert caught.value.code == 0
    assert picture.read_bytes().startswith(b"\x89PNG")
    said = capfd.readouterr()
    assert "step events" in said.out and f"wrote {picture}" in said.err.replace("\n", "")


def test_ci_script_is_well_formed() -> None:
    subprocess.run(["bash", "-n", str(ROOT / ".ci" / "run")], check=True)


@pytest.mark.skipif(shutil.which("make") is None, reason="make is not installed")
def test_lint_runs_all_lints() -> None:
    """GNU make has a variable LINT of its own; ours is ONLY, and empty."""
    run = subprocess.run(["make", "-n", "-C", str(ROOT), "lint"], capture_output=True, text=True, check=True)
    assert any(line.rstrip().endswith("tools/dev.py --venv .venv lint") for line in run.stdout.splitlines())
