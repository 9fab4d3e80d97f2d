"""Exit codes: one table, and the error boundary keeps to it."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from wificnc import errors
from wificnc.app import main, root
from wificnc.errors import Exit, UserError

CLI = Path(errors.__file__).parent


def exit_code(*arguments: str) -> int:
    with pytest.raises(SystemExit) as ended:
        main(list(arguments))
    return int(ended.value.code or 0)


def test_an_error_of_the_program_is_not_a_refusal(monkeypatch: pytest.MonkeyPatch, capsys) -> None:
    def fail(**_: object) -> None:
        raise ValueError("oh")

    monkeypatch.setattr(root, "main", fail)
    assert exit_code("status") == Exit.BUG
    said = capsys.readouterr().err
    assert "Traceback" in said
    assert "ValueError: oh" in said
    assert "please report" in said


@pytest.mark.parametrize("kind", UserError.__subclasses__())
def test_every_kind_of_error_has_its_code(kind: type[UserError], monkeypatch: pytest.MonkeyPatch, capsys) -> None:
    def fail(**_: object) -> None:
        raise kind("oh")

    monkeypatch.setattr(root, "main", fail)
    assert exit_code("status") == kind.exit_code
    assert "error: o" in capsys.readouterr().err


def test_exit_codes_are_written_in_one_place() -> None:
    """Numbers in `exit()` calls of commands would be a second home."""
    numbers = re.compile(r"(?:SystemExit|sys\.exit|ctx\.exit)\([^)]*\b\d+\b")
    found = [str(path) for path in CLI.rglob("*.py") if numbers.search(path.read_text(encoding="utf-8"))]
    assert found == []
