"""`wificnc flash` of a PIC32MZ: the exact command of each program that can."""

from __future__ import annotations

from pathlib import Path

import pytest
from wificnc.app import main
from wificnc.board.model import Board
from wificnc.errors import Exit, FlashError
from wificnc.firmware.flash.pic32mz import RUNNERS, plan_flash


@pytest.fixture
def image(tmp_path: Path) -> Path:
    path = tmp_path / "wificnc.hex"
    path.write_text(":00000001FF\n")
    return path


def installed(*names: str):  # type: ignore[no-untyped-def]
    return lambda name: f"/opt/{name}" if name in names else None


@pytest.mark.parametrize(
    ("names", "tool", "wanted"),
    [
        (["mikro_hb"], None, ["/opt/mikro_hb", "IMAGE"]),
        (["pic32prog"], None, ["/opt/pic32prog", "IMAGE"]),
        (["ipecmd"], None, ["/opt/ipecmd", "-TPPK4", "-P32MZ2048EFH100", "-M", "-FIMAGE", "-OL"]),
        (["pic32prog", "mikro_hb"], "pic32prog", ["/opt/pic32prog", "IMAGE"]),
        (["ipecmd.sh", "mikro_hb"], None, ["/opt/mikro_hb", "IMAGE"]),
    ],
)
def test_commands(board: Board, image: Path, names: list[str], tool: str | None, wanted: list[str]) -> None:
    command = plan_flash(board, image, tool, installed(*names))
    assert command == [word.replace("IMAGE", str(image)) for word in wanted]


def test_without_a_program_the_hint_names_all(board: Board, image: Path) -> None:
    with pytest.raises(FlashError) as caught:
        plan_flash(board, image, None, installed())
    assert all(runner.name in (caught.value.hint or "") for runner in RUNNERS)


def test_a_program_that_is_asked_for_must_be_there(board: Board, image: Path) -> None:
    with pytest.raises(FlashError, match="ipecmd is not installed"):
        plan_flash(board, image, "ipecmd", installed("mikro_hb"))


def test_without_a_build(board: Board, tmp_path: Path) -> None:
    with pytest.raises(FlashError) as caught:
        plan_flash(board, tmp_path / "wificnc.hex", None, installed("mikro_hb"))
    assert caught.value.hint == "wificnc build pic32mz2048efh100"


def program(folder: Path, code: int) -> None:
    path = folder / "pic32prog"
    path.write_text(f'#!/bin/sh\necho "$@" > "{folder}/said"\nexit {code}\n')
    path.chmod(0o755)


def flash(*options: str) -> int:
    with pytest.raises(SystemExit) as caught:
        main(["flash", "pic32mz2048efh100", *options])
    return int(caught.value.code or 0)


def test_the_command_runs_what_it_prints(
    image: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = image.parent
    program(folder, 0)
    monkeypatch.setenv("PATH", str(folder))
    assert flash("--from", str(folder), "--dry-run") == Exit.OK
    assert capsys.readouterr().out == f"{folder}/pic32prog {image}\n" and not (folder / "said").exists()
    assert flash("--from", str(folder), "--tool", "pic32prog") == Exit.OK
    assert (folder / "said").read_text() == f"{image}\n"


def test_a_program_that_fails(image: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    program(image.parent, 1)
    monkeypatch.setenv("PATH", str(image.parent))
    assert flash("--from", str(image.parent)) == Exit.FLASH
    assert "pic32prog could not write the board" in capsys.readouterr().err


def test_options_of_other_chips_are_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert flash("--erase") == Exit.FLASH
    assert "not for a PIC32MZ" in capsys.readouterr().err
