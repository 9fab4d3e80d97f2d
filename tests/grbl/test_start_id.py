"""The start id: a number that is another one after each start of the controller."""

from __future__ import annotations

import re

from c_library import LIB
from grbl_host import Grbl

ID = 0x00C0FFEE
FIELD = "|Start:00C0FFEE"


def test_it_is_in_the_first_report_after_a_banner_in_full_reports_and_in_build_info(grbl: Grbl) -> None:
    LIB.host_set_start(grbl._host, ID)
    assert FIELD in grbl.send("\x18\x00" + "?") or FIELD in grbl.send("?")
    assert FIELD not in grbl.send("?")
    assert FIELD in grbl.send("\x87")
    assert re.search(r"^\[START:00C0FFEE\]\r$", grbl.send("$I\n"), re.M)


def test_a_target_without_one_says_nothing(grbl: Grbl) -> None:
    assert "Start" not in grbl.send("\x87") and "START" not in grbl.send("$I\n")
