"""The start id: a number that is another one after each start of the controller."""

from __future__ import annotations

from c_library import LIB
from grbl_host import Grbl

ID = 0x00C0FFEE
FIELD = f"|Start:{ID:08X}"


def test_it_is_in_the_first_report_after_a_banner_in_full_reports_and_in_build_info() -> None:
    """As the chips have it: tests/pic32mz/test_pic32mz_talk.py."""
    grbl = Grbl()
    LIB.host_set_start(grbl._host, ID)
    for _ in range(2):
        grbl.send("\x18")
        assert FIELD in grbl.send("?")
        assert "Start" not in grbl.send("?")
    assert FIELD in grbl.send("\x87")
    assert f"[START:{ID:08X}]\r\n" in grbl.send("$I\n").splitlines(keepends=True)
    grbl.close()


def test_a_target_without_one_says_nothing() -> None:
    grbl = Grbl()
    assert "Start" not in grbl.send("\x87") and "START" not in grbl.send("$I\n")
    grbl.close()
