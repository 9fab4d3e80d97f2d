"""`wificnc --help`: a newcomer finds the command by what it is for."""

from __future__ import annotations

import re

from click.testing import CliRunner
from wificnc.app import COMMANDS, GROUPS, root


def shown(*argv: str) -> dict[str, list[str]]:
    """Headings of the help, and the names below each."""
    text = CliRunner().invoke(root, [*argv, "--help"], prog_name="wificnc", env={"COLUMNS": "100"}).output
    headings: dict[str, list[str]] = {}
    names: list[str] = []
    for line in text.splitlines():
        if heading := re.match(r"╭─ (\w+) ─", line):
            names = headings.setdefault(heading[1], [])
        elif name := re.match(r"│ ([a-z][a-z0-9]*)  ", line):
            names.append(name[1])
    return headings


def test_every_command_has_its_place() -> None:
    headings = shown()
    assert list(headings)[1:] == ["Machine", "Job", "Board", "Firmware", "Protocol"]
    assert sorted(name for names in headings.values() for name in names) == sorted(COMMANDS)
    assert {name: list(group) for name, group in GROUPS.items()} == {h: n for h, n in headings.items() if h in GROUPS}


def test_commands_of_a_command_are_no_commands_of_wificnc() -> None:
    """`boards check` is not listed as `check` is, and `dev pins` is not among what users need."""
    assert not set(shown("boards")) & set(GROUPS)
    assert {"pins", "page"} <= set(shown("dev")["Commands"])
