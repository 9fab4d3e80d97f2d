"""Checklist 4.7 and 4.8: what senders were written against, held over everything that the controller says."""

from __future__ import annotations

import random
import re

import pytest
from grbl_host import BANNER, Grbl

NUMBER = r"-?\d+(?:\.\d+)?"
STATES = r"(?:Idle|Run|Hold:[01]|Jog|Alarm|Door:[0-3]|Check|Home|Sleep)"
FIELD = rf"(?:[MW]Pos|WCO):{NUMBER}(?:,{NUMBER}){{2,5}}|Bf:\d+,\d+|Ln:\d+|FS:{NUMBER},\d+|Pn:P?X?Y?Z?A?B?C?D?R?H?S?"
EXTRA = rf"(?!S:|C:|A:)[A-Z][A-Za-z]*:{NUMBER}(?:,{NUMBER}){{0,5}}"
REPORT = re.compile(rf"<{STATES}(?:\|(?:{FIELD}|Ov:\d+,\d+,\d+(?:\|A:[SC]?F?M?)?|{EXTRA}))+>")
PROBE = re.compile(rf"\[PRB:{NUMBER}(?:,{NUMBER}){{2,5}}:[01]\]")
WORDS = ["G91G1F2000X-1", "G0Y1", "M3S500", "M8", "M7", "M9", "M5", "G4P.05", "$J=G91X1F900", "$C", "G55", "G92Z1",
         "N7G0Z-.1", "G38.3Z-1F200", "$SLP", "!", "~", "\x84", "\x91", "\x97", "\x18", "$X", "M0", "$10=3",
         "$10=0"]  # fmt: skip


@pytest.mark.parametrize("axes", [3, 6])
@pytest.mark.parametrize("seed", range(6))
def test_every_report_is_one_that_senders_read(seed: int, axes: int) -> None:
    """UGS: `FS:` two values; `Ov:` exactly three; alarms 1-9 only; `PRB` up to 6 axes. Extra status fields must be
    `|Name:number[,number]`, <= 6 values, names not `S`, `C`, `A`; no field in `Pn:`. Ours: alarm 10 squaring, 50
    e-stop."""
    pick, grbl = random.Random(seed), Grbl(axes)
    said = ""
    for _ in range(150):
        word = pick.choice(WORDS)
        said += grbl.after(pick.random() * 0.2, word if len(word) == 1 else word + "\n")
        said += grbl.after(0, "?")
        if pick.random() < 0.05:
            grbl.input(pick.choice(["door", "probe", "limit-x", "hold", "start"]), pick.random() < 0.4)
    grbl.close()
    lines = [line for line in said.split("\r\n") if line]
    reports = [line for line in lines if line.startswith("<")]
    assert len(reports) > 50
    for line in lines:
        if line.startswith("<"):
            assert REPORT.fullmatch(line), line
        elif line.startswith("[PRB"):
            assert PROBE.fullmatch(line), line
        elif line.startswith("ALARM"):
            assert int(line[6:]) in {*range(1, 11), 50}
        else:
            assert re.fullmatch(r"ok|error:\d+|\[\w+:.*\]|Grbl .*|\$.*|>.*", line), line


def test_banner(grbl: Grbl) -> None:
    """CNCjs: banner regexp needs a dotted number after the first word; UGS accepts `Grbl ` and reads its version."""
    line = grbl.send("\x18").strip()
    assert re.match(r"^[a-zA-Z]\w* (\d+\.\d+[a-zA-Z]?)\b", line)[1] == "1.1h" and line.endswith("help]")


def test_a_jog_faster_than_the_machine(grbl: Grbl) -> None:
    """bCNC: jogs `$J=G91 X.. F100000`: runs at the top speed of the axis."""
    before = grbl.time()
    assert grbl.send("$J=G91 X-50 F100000\n") == "ok\r\n"
    top = 5000 / 60
    assert grbl.time() - before == pytest.approx(50 / top + top / 500, rel=0.02)


@pytest.mark.parametrize("wake", ["\r\n\r\n", "\n\n"])
def test_wake_up(grbl: Grbl, wake: str) -> None:
    r"""Wake-up is `\r\n\r\n` (Grbl's own scripts) or `\n\n` (bCNC): all answers are out immediately."""
    assert grbl.after(0.001, wake) == "ok\r\nok\r\n"


def test_questions_beside_the_count(grbl: Grbl) -> None:
    """grbl-streamer writes `$#` and `$G` outside its own byte count: keep reserve in the receive buffer."""
    jobs = "G4P1\n" + "G4P0\n" * 24  # 125 bytes of the 128 that it thinks there are
    grbl.after(0, jobs)
    grbl.flood("$#\n$G\n")
    said = grbl.send("")
    assert said.count("ok\r\n") == 27 and "overflow" not in said and "error" not in said


def test_254_bytes_in_flight(grbl: Grbl) -> None:
    """stream.py keeps 126 bytes in flight, but allows 254 while 128 or more reply bytes wait unread."""
    grbl.after(0, "G4P1\n")
    grbl.flood("G0X1Y1\n" * (254 // 7))
    assert grbl.send("").count("ok\r\n") == 1 + 254 // 7


def test_only_the_banner_begins_with_grbl(grbl: Grbl) -> None:
    """gantrix takes any line starting with `Grbl` during a command as a reset."""
    said = grbl.send("$$\n$#\n$G\n$I\n$N\n$\n$I=Grbl\n$N0=(Grbl)G0\n$I\n$N\n?")
    assert not any(line.startswith("Grbl") for line in said.split("\r\n"))
    assert grbl.send("\x18").startswith(BANNER)
