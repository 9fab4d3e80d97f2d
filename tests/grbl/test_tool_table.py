"""The tool table: length, diameter and text by G10 L1, its R and its comment; listed by $# as grblHAL does."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from grbl_host import Grbl

INCH_MM = 25.4


def tools(listed: str) -> list[str]:
    return re.findall(r"^\[T:(.*)\]\r$", listed, re.MULTILINE)


@pytest.fixture
def kept(tmp_path: Path) -> Path:
    return tmp_path / "store"


def started(store: Path) -> Grbl:
    controller = Grbl(store=store)
    said = controller.send("")
    assert "damaged" not in said
    return controller


def after_power_on(store: Path, *lines: str) -> list[str]:
    """The table as it is after these lines and another power-on."""
    first = started(store)
    first.fine(*lines)
    first.close()
    second = started(store)
    found = tools(second.send("$#\n"))
    second.close()
    return found


def test_length_radius_and_text_are_kept(kept: Path) -> None:
    lines = ("G10L1P2Z12.5R3 (6 mm flat)", "G10 L1 P96 R0.5 ; engraver 30 deg", "G10L1P1Z-3")
    assert after_power_on(kept, *lines) == [
        "1|0.000,0.000,-3.000|0.000",
        "2|0.000,0.000,12.500|3.000|6 mm flat",
        "96|0.000,0.000,0.000|0.500|engraver 30 deg",
    ]


def test_what_a_line_does_not_name_stays(kept: Path) -> None:
    lines = ("G10L1P2Z12.5R3(6 mm flat)", "G10L1P2Z11", "G10L1P2R2.9", "G10L1P17R1(drill)", "G10L1P18R2")
    lines += ("G10L1P2R3(new)",)
    assert after_power_on(kept, *lines) == [
        "2|0.000,0.000,11.000|3.000|new",
        "17|0.000,0.000,0.000|1.000|drill",
        "18|0.000,0.000,0.000|2.000",
    ]


def test_a_note_is_cleared(kept: Path) -> None:
    """A comment of a blank is no text; R0 no diameter."""
    assert after_power_on(kept, "G10L1P5R3(ball)", "G10L1P6R1", "G10L1P5R0( )") == ["6|0.000,0.000,0.000|1.000"]
    assert after_power_on(kept, "G10L1P6R0") == []


@pytest.mark.parametrize("what", ["#", "*"])
def test_restore_clears_all(kept: Path, what: str) -> None:
    first = started(kept)
    first.fine(*(f"G10L1P{tool}Z{tool}R1(tool {tool})" for tool in range(1, 97, 5)))
    assert len(tools(first.send("$#\n"))) == 20
    first.after(1, f"$RST={what}\n")
    assert tools(first.send("$#\n")) == []
    first.close()
    assert after_power_on(kept) == []


def test_all_tools_have_the_longest_text(kept: Path) -> None:
    """The store has room for the whole table next to all else, and a text is cut where its room ends."""
    first = started(kept)
    first.fine("$100=640", "G10L2P1X5", "$N0=G21", "$I=SHOP")
    first.fine(*(f"G10L1P{tool}Z{tool}R{tool}(tool {tool:02d} with a long text, too long)" for tool in range(1, 97)))
    first.close()
    second = started(kept)
    assert tools(second.send("$#\n")) == [
        f"{tool}|0.000,0.000,{tool}.000|{tool}.000|tool {tool:02d} with a long tex" for tool in range(1, 97)
    ]
    assert "$N0=G21" in second.send("$N\n") and "$100=640.000" in second.send("$$\n")
    second.close()


def test_inches(kept: Path) -> None:
    controller = started(kept)
    controller.fine("G20", "G10L1P1Z1R0.125(1/4 in)", "$13=1")
    assert tools(controller.send("$#\n")) == ["1|0.0000,0.0000,1.0000|0.1250|1/4 in"]
    controller.fine("$13=0")
    assert tools(controller.send("$#\n")) == [f"1|0.000,0.000,{INCH_MM:.3f}|{INCH_MM / 8:.3f}|1/4 in"]
    controller.close()


def test_a_text_never_ends_its_report(kept: Path) -> None:
    assert after_power_on(kept, "G10L1P1R1;[V-bit] 60|30") == ["1|0.000,0.000,0.000|1.000|(V-bit) 60/30"]


def test_check_mode_stores_nothing(kept: Path) -> None:
    controller = started(kept)
    controller.send("$C\n")
    controller.fine("G10L1P3Z9R2(tried)")
    controller.send("$C\n")
    assert tools(controller.send("$#\n")) == []
    controller.close()
    assert after_power_on(kept) == []


def test_a_startup_line_takes_no_text_of_another_line(kept: Path) -> None:
    controller = started(kept)
    controller.fine("$N0=G10L1P4R2")
    controller.put("G0X0 (approach)\n")
    controller.send("")
    controller.send("\x18")
    assert tools(controller.send("$#\n")) == ["4|0.000,0.000,0.000|2.000"]
    controller.close()


def test_the_text_is_of_its_own_line(kept: Path) -> None:
    """A line of the operator comes while that of the job waits for rest."""
    controller = started(kept)
    controller.settings(s110=600, s120=10)
    controller.after(0.5, "G1X5F600\nG10L1P7R1(of the job)\n")
    controller.after(3, "!")
    controller.after(0.1, "\xa3")
    controller.after(0.5, "G91 (of the operator)\n")
    controller.after(20, "~")
    assert tools(controller.send("$#\n")) == ["7|0.000,0.000,0.000|1.000|of the job"]
    controller.close()


def test_without_a_store_a_note_says_that_it_is_lost(grbl: Grbl) -> None:
    said = grbl.send("G10L1P1Z2R1(flat)\n")
    listed = tools(grbl.send("$#\n"))
    assert said == "ok\r\n" or (said == "[MSG:Not stored]\r\nok\r\n" and listed == ["1|0.000,0.000,2.000|0.000"])


@pytest.mark.parametrize(
    ("line", "answer"),
    [
        ("G10L1P1R-1", 4),
        ("G10L1P1R999999", 33),
        ("G10L1P97R1", 38),
        ("G10L1R1", 28),
        ("G10L10P1R1", 26),
        ("G10L2P1X1R1", 20),
        ("G10L1P1X1R1", 37),
    ],
)
def test_refusals(grbl: Grbl, line: str, answer: int) -> None:
    assert grbl.send(f"{line}\n") == f"error:{answer}\r\n"


def test_a_damaged_note_is_said_and_acknowledged(kept: Path) -> None:
    first = started(kept)
    first.fine("G10L1P1Z2R1(flat)", "G10L1P33R3(ball)")
    first.close()
    kept.write_bytes(kept.read_bytes().replace(b"ball", b"bald"))
    second = Grbl(store=kept)
    assert "Stored data is damaged: notes of T33 to T48. Check" in second.send("")
    assert tools(second.send("$#\n")) == ["1|0.000,0.000,2.000|1.000|flat"]
    assert second.send("G10L1P2R1\n") == "error:9\r\n", "locked"
    assert second.send("$ACK\n").endswith("ok\r\n")
    second.close()
    assert after_power_on(kept, "G10L1P33R3(new)") == [
        "1|0.000,0.000,2.000|1.000|flat",
        "33|0.000,0.000,0.000|3.000|new",
    ]
