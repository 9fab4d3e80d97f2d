"""Check mode ($C): what a program does to offsets and tools holds in the check and not after it."""

from __future__ import annotations

import pytest
from grbl_host import Grbl


@pytest.mark.parametrize("way_out", ["$C\n", "\x18"])
@pytest.mark.parametrize(
    "line", ["G10L2P1Z5", "G10L20P2X7", "G10L1P3Z9", "G28.1", "G30.1", "G92X3", "G43.1Z2"], ids=lambda line: line[:6]
)
def test_a_check_changes_no_offset(grbl: Grbl, line: str, way_out: str) -> None:
    """Ours; Grbl stores G10 in check mode. Who tries a program does not want its zeros."""
    grbl.fine("G0X1Y1Z1")
    grbl.after(2)
    before = grbl.send("$#\n")
    assert grbl.send("$C\n").endswith("ok\r\n")
    grbl.fine(line)
    assert grbl.send("$#\n") != before or line.startswith(("G28", "G30")), "the rest of the program sees it"
    grbl.send(way_out)
    assert grbl.send("$#\n") == before
    grbl.send("\x18")
    assert grbl.send("$#\n") == before
