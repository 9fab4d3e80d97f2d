"""`wificnc tune` as a process would run it."""

from __future__ import annotations

import pytest
from wificnc.app import main


class Cli:
    """Runs commands: exit code, stdout, stderr."""

    def __init__(self, capsys: pytest.CaptureFixture[str]) -> None:
        self._capsys = capsys

    def main(self, *words: object) -> tuple[int, str, str]:
        with pytest.raises(SystemExit) as ended:
            main([str(word) for word in words])
        out, err = self._capsys.readouterr()
        return int(ended.value.code or 0), out, err

    def __call__(self, *words: object) -> tuple[int, str, str]:
        return self.main("tune", *words)


@pytest.fixture
def tune(capsys: pytest.CaptureFixture[str]) -> Cli:
    return Cli(capsys)
