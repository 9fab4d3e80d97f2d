"""What git does not keep (build/generated): it is written when a source has changed, and only then."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest
from generate import built
from tools_here import needs_git
from wificnc.board.load import find_boards
from wificnc.build.checkout import checkout_root
from wificnc.errors import UserError

ROOT = checkout_root()
BOARD = "boards/mine.toml"


@pytest.fixture
def tree(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """With one source, from which a file of the same name is made for each of its lines."""
    (tmp_path / "boards").mkdir()
    (tmp_path / BOARD).write_text("one\ntwo\n")

    def texts(root: Path) -> dict[str, str]:
        return {f"{built.FOLDER}/{line}/{line}.txt": f"{line}\n" for line in (root / BOARD).read_text().split()}

    monkeypatch.setattr(built, "texts", texts)
    return tmp_path


def made(tree: Path) -> set[str]:
    return {path.name for path in (tree / built.FOLDER).rglob("*.txt")}


def test_a_second_call_computes_nothing(tree: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert [Path(name).name for name in built.bring_up_to_date(tree)] == ["one.txt", "two.txt"]
    monkeypatch.setattr(built, "texts", lambda root: pytest.fail("computed again"))
    assert built.bring_up_to_date(tree) == []


def test_a_changed_source_writes_what_differs(tree: Path) -> None:
    built.bring_up_to_date(tree)
    (tree / BOARD).write_text("two\nthree\n")
    assert [Path(name).name for name in built.bring_up_to_date(tree)] == ["three.txt"]
    assert made(tree) == {"two.txt", "three.txt"}


def test_a_new_source_is_noticed(tree: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    built.bring_up_to_date(tree)
    (tree / "boards/other.toml").touch()
    monkeypatch.setattr(built, "texts", lambda root: {f"{built.FOLDER}/new.txt": "new\n"})
    assert built.bring_up_to_date(tree) == [f"{built.FOLDER}/new.txt"]
    assert made(tree) == {"new.txt"}


@pytest.mark.parametrize("edit", [lambda path: path.unlink(), lambda path: path.write_text("by hand\n")])
def test_a_file_that_was_deleted_or_edited_is_written_again(tree: Path, edit) -> None:
    built.bring_up_to_date(tree)
    edit(tree / built.FOLDER / "one/one.txt")
    assert built.bring_up_to_date(tree) == [f"{built.FOLDER}/one/one.txt"]


def test_a_touched_source_writes_nothing(tree: Path) -> None:
    """So nothing is built again for it."""
    built.bring_up_to_date(tree)
    os.utime(tree / BOARD, (1, 1))
    assert built.bring_up_to_date(tree) == []


def test_a_wrong_table_is_named_and_tried_again(
    tree: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def refuse(root: Path) -> dict[str, str]:
        raise UserError("boards/mine.toml: no such pin")

    with monkeypatch.context() as patch:
        patch.setattr(built, "texts", refuse)
        assert built.main(tree) != 0
        assert built.main(tree) != 0
    assert "no such pin" in capsys.readouterr().err
    assert built.main(tree) == 0 and made(tree) == {"one.txt", "two.txt"}


def test_each_board_has_its_picture_and_rows() -> None:
    texts = built.texts(ROOT)
    for path in find_boards():
        assert texts[f"{built.FOLDER}/pinout/{path.stem}.svg"].startswith("<svg")
        assert f'"id": "{path.stem}"' in texts[f"{built.FOLDER}/boards.json"]
        assert path.read_text(encoding="utf-8").startswith(f"#:schema ../{built.FOLDER}/board.schema.json\n")


@needs_git
def test_git_does_not_keep_them() -> None:
    names = list(built.texts(ROOT))
    said = subprocess.run(["git", "check-ignore", *names], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    assert said.split() == names
