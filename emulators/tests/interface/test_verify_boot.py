"""A board file of one's own, outside of boards/, is looked for where it is."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from wificnc.board import paths
from wificnc.board.load import load_board
from wificnc.simulator.run import SimOptions
from wificnc_chips import verify


def test_verify_boot_compares_with_this_file_and_no_id(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its id is none of boards/: the firmware was blamed for "unknown board"."""
    own = tmp_path / "mine.toml"
    own.write_text((paths.BOARDS / "esp32-wroom32.toml").read_text(encoding="utf-8"), encoding="utf-8")
    asked: list[SimOptions] = []

    def run(board: Any, options: SimOptions, *_: Any, **__: Any) -> SimpleNamespace:
        asked.append(options)
        return SimpleNamespace(errors=[], first_difference=None, events=1)

    monkeypatch.setattr(verify, "run_on_chip", run)
    monkeypatch.setattr(verify, "wire", lambda *_: SimpleNamespace(close=lambda: None))
    monkeypatch.setattr(verify, "greet", lambda _: "Grbl 1.1h ['$' for help]\r\n")
    monkeypatch.setattr(verify, "_ask", lambda *_: "[VER:1.1h.20190825:]\r\n")
    verify.verify_boot(load_board(own), tmp_path / "image")
    assert load_board(asked[0].board).path == own
