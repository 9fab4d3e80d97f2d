"""tools/sizes: budgets, and growth against an earlier build, from made-up firmware."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from sizes.__main__ import main
from sizes.compare import growth
from test_esp32_size import KB, build
from wificnc.build.esp32_size import IMAGE_BUDGET

NAME = "esp32-wroom32 by idf"


def measure(folder: Path, image: int, output: Path) -> int:
    build(folder, image, [(0x40080000, 96 * KB)])
    return main(["measure", "esp32-wroom32", "--by", "idf", "--folder", str(folder), "-o", str(output)])


def test_measure(tmp_path: Path) -> None:
    assert measure(tmp_path, 1_100_000, tmp_path / "sizes.json") == 0
    assert json.loads((tmp_path / "sizes.json").read_text()) == {NAME: {"image": 1_100_000, "IRAM": 96 * KB}}


def test_a_budget_that_is_exceeded_fails(tmp_path: Path, capsys) -> None:
    assert measure(tmp_path, IMAGE_BUDGET + 1, tmp_path / "sizes.json") == 1
    assert "budget" in capsys.readouterr().err


def test_what_is_not_there_is_an_error(tmp_path: Path) -> None:
    assert main(["measure", "esp32-wroom32", "--by", "idf", "--folder", str(tmp_path), "-o", str(tmp_path / "x")]) == 2
    assert not (tmp_path / "x").exists()


@pytest.mark.parametrize(("old", "new", "grown"), [(1000, 1050, 0), (1000, 1051, 1), (1000, 500, 0), (0, 1000, 0)])
def test_growth(old: int, new: int, grown: int) -> None:
    lines, wrong = growth({NAME: {"image": old}}, {NAME: {"image": new}})
    assert len(lines) == 1 and len(wrong) == grown


def test_a_new_board_has_not_grown() -> None:
    assert growth({}, {NAME: {"image": 1}})[1] == []


@pytest.mark.parametrize(("before", "code"), [(1000, 1), (2000, 0), (None, 0)])
def test_compare(tmp_path: Path, before: int | None, code: int) -> None:
    """Without an earlier build nothing is compared; the file for the next one is written in any case."""
    old, out = tmp_path / "old.json", tmp_path / "all.json"
    if before is not None:
        old.write_text(json.dumps({"a": {"image": before}}))
    files = []
    for name in ("a", "b"):
        files.append(str(tmp_path / f"{name}.json"))
        Path(files[-1]).write_text(json.dumps({name: {"image": 1500}}))
    assert main(["compare", "--before", str(old), "--now", *files, "-o", str(out)]) == code
    assert json.loads(out.read_text()) == {"a": {"image": 1500}, "b": {"image": 1500}}


@pytest.mark.parametrize("text", ["", "[]", '{"a": 1}', '{"a": {"image": "x"}}'])
def test_a_damaged_file_is_an_error(tmp_path: Path, text: str) -> None:
    (tmp_path / "now.json").write_text(text)
    assert main(["compare", "--before", "none", "--now", str(tmp_path / "now.json"), "-o", str(tmp_path / "x")]) == 2
