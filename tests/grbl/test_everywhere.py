"""Interruptions at every moment: nothing is lost, the position is what the pins made, every line has one answer."""

from __future__ import annotations

import random

import pytest
from grbl_host import Grbl

JOB = "G1F3000X-8\nY-5\nG2X-12Y-9I-4\nM3S100\nG4P.05\nG0Z-2\nG1X-1Y-1Z0F2000\nM5\n"
END = [-250, -250, 0, 0, 0, 0]
MOMENTS = [0.0111 * k + 0.0007 for k in range(1, 100, 6)]


@pytest.mark.parametrize("moment", MOMENTS)
@pytest.mark.parametrize("stop", ["!", "\x84"])
def test_stops_and_goes_on(grbl: Grbl, stop: str, moment: float) -> None:
    """Every line gets exactly one answer and the job ends where it should."""
    said = grbl.after(moment, JOB) + grbl.send(stop)
    assert grbl.state() in ("Hold:0", "Door:0")
    said += grbl.send("~")
    assert said.count("ok\r\n") == JOB.count("\n") and grbl.position() == END == grbl.stands()


@pytest.mark.parametrize("moment", MOMENTS)
@pytest.mark.parametrize("stop", ["\x18", "!\x18", "estop"])
def test_ends_and_starts_anew(grbl: Grbl, stop: str, moment: float) -> None:
    """E-stop and reset keep the exact position; the same job runs from there."""
    grbl.after(moment, JOB)
    if stop == "estop":
        grbl.input("estop", True)
        at = grbl.stands()
        grbl.send("")
        assert grbl.stands() == at
        grbl.input("estop", False)
    grbl.send("\x18" if stop == "estop" else stop)
    assert grbl.position() == grbl.stands()
    grbl.send("$X\n")
    assert grbl.send(JOB).count("ok\r\n") == JOB.count("\n")
    assert grbl.position() == END == grbl.stands()


@pytest.mark.parametrize("moment", MOMENTS[:10])
def test_jogs_end_anywhere(grbl: Grbl, moment: float) -> None:
    """A cancelled jog stays where it is, and the next one is exact."""
    grbl.after(moment, "$J=G91X-7Y3F3000\n$J=G91Z-5F3000\n")
    grbl.send("\x85")
    assert grbl.position() == grbl.stands() and grbl.state() == "Idle"
    grbl.send("$J=G90X1Y2Z-3F3000\n")
    assert grbl.position() == grbl.stands() == [250, 500, -750, 0, 0, 0]


WORDS = [
    "G0X1",
    "G1Y-2F900",
    "$$",
    "$G",
    "$#",
    "$10=3",
    "",
    "G4P.01",
    "M3S9",
    "M5",
    "X",
    "$J=X1F99",
    "$N0=G21",
    "~~",
    "G38.3Z-1F100",
]


@pytest.mark.parametrize("seed", range(20))
def test_one_answer_a_line(grbl: Grbl, seed: int) -> None:
    """A single lost `ok` hangs senders for ever. Each line gets exactly one `ok` or `error:N`, whatever comes, with
    reports and overrides in between."""
    pick = random.Random(seed)
    lines = [pick.choice(WORDS) for _ in range(200)]
    noise = ["?", "\x91", "\x94", "\x9a", "\xa0", "\x8f", "~"]
    said = grbl.send("".join(pick.choice(["", pick.choice(noise)]) + line + "\n" for line in lines))
    answers = [a for a in said.split("\r\n") if a == "ok" or a.startswith("error:")]
    assert len(answers) == len(lines) and grbl.position() == grbl.stands()


@pytest.mark.parametrize("seed", range(20))
def test_any_bytes(grbl: Grbl, seed: int) -> None:
    """Nothing that arrives can crash, hang or lose the position; a reset always leads back."""
    pick = random.Random(seed)
    grbl.travel(0, -3000, 3000)
    grbl.surface(-300)
    for _ in range(30):
        line = pick.choice([*WORDS, "$H", "$C", "$SLP", "$RST=*", "$22=1", "$21=1", "M0"])
        grbl.after(pick.random() * 0.1, line + "\n" * pick.randint(0, 2))
        grbl.after(pick.random() * 0.1, bytes(pick.randrange(256) for _ in range(3)).decode("latin-1"))
        if pick.random() < 0.1:
            grbl.input(pick.choice(grbl.inputs), pick.random() < 0.3)
    for name in grbl.inputs:
        grbl.input(name, False)
    grbl.send("\x18")
    grbl.send("$X\n")
    grbl.send("\x18")
    assert grbl.send("$$\n").endswith("ok\r\n")
