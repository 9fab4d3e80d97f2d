"""Values of a board file that have the right type and are wrong all the same: each is reported at its key."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner
from wificnc.app import root
from wificnc.board import paths
from wificnc.board.load import check_board
from wificnc.errors import Exit
from wificnc.profile import check_machine

GOOD_TEXT = (paths.BOARDS / "esp32s3-devkitc.toml").read_text(encoding="utf-8")
NOTE_1 = '"Without the W5500, GPIO0, 45, 46 and 47 stay unused.",'
EXAMPLES = Path(__file__).resolve().parents[2] / "examples" / "machines"
EMPTY = "is an empty list"
CASES = [
    ("flash_mb = [8, 16]", "flash_mb = []", "memory.flash_mb", EMPTY),
    ("psram_mb = [8]", "psram_mb = []", "memory.psram_mb", EMPTY),
    ("flash_mb = [8, 16]", "flash_mb = [8, 8]", "memory.flash_mb", "has 8 twice"),
    ("flash_mb = [8, 16]", "flash_mb = [true]", "memory.flash_mb[0]", "must be a whole number"),
    ("flash_mb = [8, 16]", "flash_mb = [-8]", "memory.flash_mb[0]", "-8 MB"),
    ("flash_mb = [8, 16]", 'flash_mb = "8"', "memory.flash_mb", "must be a list"),
    ('onboard = ["GPIO48"]', "onboard = []", "onboard", EMPTY),
    ('onboard = ["GPIO48"]', 'onboard = [""]', "onboard[0]", "has no pin ''"),
    ('onboard = ["GPIO48"]', 'onboard = ["GPIO48", "GPIO48"]', "onboard", "has GPIO48 twice"),
    ('misc = ["GPIO18"]', "misc = []", "input.misc", EMPTY),
    ("schema = 1", "schema = true", "schema", "must be a whole number"),
    ("schema = 1", "schema = 1.0", "schema", "must be a whole number"),
    ('summary = "Six', 'summary = " Six', "summary", "must not begin or end with a blank"),
    ('summary = "Six', 'summary = "\\u001b[31m Six', "summary", "one line of printable characters"),
    ('summary = "Six', 'summary = "Red\\nSix', "summary", "one line of printable characters"),
    ('name = "J1"', 'name = " "', "header[0].name", "must not be empty"),
    ('name = "J1"\nside = "left"', 'name = "J3"\nside = "right"', "header", "has right J3 twice"),
    ('url = "https://docs', 'url = "docs', "source.url", "^https?://"),
    ("default_pulse_us = 3", "default_pulse_us = 0", "timing.default_pulse_us", "greater than or equal to 1"),
    ('key = "ethernet.int"', 'key = "ethernet.cs"', "deviation", "has ethernet.cs twice"),
    ('key = "ethernet.int"', 'key = "ethernet.intt"', "deviation[1].key", "'ethernet.intt' is not a pin or a time"),
    (NOTE_1, f"{NOTE_1} {NOTE_1}", "note", "twice"),
    (NOTE_1, f'{NOTE_1} "",', "note[2]", "must not be empty"),
    ('debug = "debugging runs over USB on this chip" } }\ndir = "GPIO38"', 'debug = "          " } }\ndir = "GPIO38"',
     "axis.z.step.allow.debug", "must not be empty"),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "key", "reason"), CASES)
def test_a_wrong_value_is_reported_at_its_key(old: str, new: str, key: str, reason: str, tmp_path: Path) -> None:
    assert GOOD_TEXT.count(old) == 1, old
    path = tmp_path / "mine.toml"
    path.write_text(GOOD_TEXT.replace(old, new), encoding="utf-8")
    problems = check_board(path)
    assert problems[0].key == key and reason in problems[0].reason
    if "twice" not in reason:  # a list is reported at its beginning
        assert problems[0].line == 1 + path.read_text(encoding="utf-8")[: path.read_text().index(new)].count("\n")
    done = CliRunner().invoke(root, ["boards", "check", str(path), "--json"])
    assert done.exit_code == Exit.BOARD and json.loads(done.stdout)[0]["key"] == key


@pytest.mark.parametrize("value", ["true", "4.0", "3"])
def test_a_choice_of_numbers_takes_whole_numbers(value: str, tmp_path: Path) -> None:
    text = (paths.BOARDS / "host.toml").read_text(encoding="utf-8")
    assert "\n[dial]\n" in text
    path = tmp_path / "mine.toml"
    path.write_text(text.replace("\n[dial]\n", f"\n[dial]\ncounts_per_detent = {value}\n"), encoding="utf-8")
    assert [problem.key for problem in check_board(path)] == ["dial.counts_per_detent"]


def test_tables_that_are_left_out_are_no_empty_ones(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(GOOD_TEXT.replace('misc = ["GPIO18"]\n', "").replace('onboard = ["GPIO48"]', "#"), encoding="utf-8")
    assert check_board(path) == []


@pytest.mark.parametrize(
    ("old", "new", "key"),
    [
        ("schema = 1", "schema = true", "schema"),
        ("schema = 1", "schema = 1.0", "schema"),
        ('name = "', 'name = " ', "name"),
    ],
)
def test_machine_profiles_have_the_same_rules(old: str, new: str, key: str, tmp_path: Path) -> None:
    text = (EXAMPLES / "router_3018.toml").read_text(encoding="utf-8")
    path = tmp_path / "mine.toml"
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    assert [problem.key for problem in check_machine(path)] == [key]
