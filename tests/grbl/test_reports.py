"""Checklist 4.3 (what needs the machine) and 4.4: reports. Each test quotes its line."""

from __future__ import annotations

import re

import pytest
from grbl_host import BANNER, LOCKED, Grbl


def fields(report: str) -> list[str]:
    return [part.split(":")[0] for part in report.strip()[1:-1].split("|")][1:]


def test_an_erroneous_line_changes_nothing(grbl: Grbl) -> None:
    """Validation precedes execution: an erroneous line changes nothing, not even modal state."""
    before = grbl.send("$G\n")
    assert "error" in grbl.send("G91G20M3S100T4X1X2\n")
    assert grbl.send("$G\n") == before and grbl.outputs().spindle_direction == 0


def test_spindle_and_coolant_synchronise_with_motion(grbl: Grbl) -> None:
    """Spindle/coolant changes **synchronise** with motion."""
    said = grbl.after(0.1, "G1X10F3000\nM3S500M8\n")
    assert said == "ok\r\n" and grbl.outputs().spindle_direction == 0
    assert grbl.send("") == "ok\r\n" and grbl.outputs().spindle_direction == 1 and grbl.outputs().coolant == 2


def test_what_a_reset_forgets(grbl: Grbl) -> None:
    """G92/TLO/PRB vanish at reset; G54-59, G28, G30 persist. T: a sane firmware keeps it."""
    grbl.surface(-500)
    grbl.fine("G10L2P2X3", "G28.1", "G92X5", "G43.1Z2", "T5", "G0X1")
    grbl.send("G38.2Z-5F100\n")
    assert "T5" in grbl.send("$G\n")
    grbl.send("\x18")
    said = grbl.send("$#\n")
    assert "[G55:3.000,0.000,0.000]" in said and "[G92:0.000,0.000,0.000]" in said
    assert "[TLO:0.000]" in said and "[PRB:0.000,0.000,0.000:0]" in said


@pytest.mark.parametrize("code", ["M2", "M30"])
def test_program_end(grbl: Grbl, code: str) -> None:
    """M2/M30: motion G1, G17 G90 G94 G54 M5 M9, overrides 100, `[MSG:Pgm End]`; S stays displayed (`S500`)."""
    grbl.fine("G18G91G55M3S500M8", "G93")
    grbl.send("\x91\x96\x9a")
    assert grbl.send(code + "\n") == "[MSG:Pgm End]\r\nok\r\n"
    assert "[GC:G1 G54 G17 G21 G90 G94 M5 M9 T0 F0 S500]" in grbl.send("$G\n")
    assert "Ov:100,100,100>" in grbl.status() + grbl.status() and grbl.outputs().spindle_direction == 0


def test_zeroing_as_senders_do_it(grbl: Grbl) -> None:
    """`G10L20P0` is what senders use for zeroing (`G10P0L20X0Y0`): the active system, other axes as they were."""
    grbl.fine("G55", "G0X3Y4Z5", "G10P0L20X0Y0")
    said = grbl.send("$#\n")
    assert "[G55:3.000,4.000,0.000]" in said and "[G54:0.000,0.000,0.000]" in said
    grbl.fine("$10=0")
    assert grbl.status().startswith("<Idle|WPos:0.000,0.000,5.000|")


def test_zeroing_subtracts_g92_and_tool_length(grbl: Grbl) -> None:
    """With G43.1 Z2 active, `G10L20P1Z0` at machine 0 stored -2.000."""
    grbl.fine("G43.1Z2", "G10L20P1Z0")
    assert "[G54:0.000,0.000,-2.000]" in grbl.send("$#\n")


def test_order_of_the_fields(grbl: Grbl) -> None:
    """`<State|MPos|Bf|Ln|FS|Pn|WCO|Ov|A>` in this order. $10 bit0 = MPos/WPos, bit1 = `Bf`."""
    grbl.fine("$10=3")
    grbl.input("probe", True)
    grbl.send("\x18")
    grbl.after(0.05, "N42G1X-10F100\n")
    assert fields(grbl.status()) == ["MPos", "Bf", "Ln", "FS", "Pn", "WCO"]
    assert "|Ln:42|" in grbl.status()
    grbl.send("")
    grbl.fine("$10=0", "G92X3")
    assert grbl.status().startswith("<Idle|WPos:3.000,0.000,0.000|FS:0,0|")


def test_the_line_that_is_named_has_begun_and_those_before_it_are_made(grbl: Grbl) -> None:
    """N words are reported as `Ln:`. A job is resumed there, also where points in a row are one move to the planner."""
    grbl.fine("$110=6000", "$120=500")
    points_mm = [0.0, 3.0, 4.0, 9.0, 9.5, 20.0, 21.0]
    grbl.put("".join(f"N{n}G1X{x}F1200\n" for n, x in enumerate(points_mm) if n))
    named = set()
    for _ in range(60):
        grbl.after(0.02)
        status = grbl.status()
        found = re.search(r"\|MPos:([\d.]+),.*\|Ln:(\d+)", status)
        if not found:
            continue
        x_mm, line = float(found[1]), int(found[2])
        named.add(line)
        assert points_mm[line - 1] <= x_mm + 0.05, status
    assert named and "Idle" in grbl.status()


def test_the_line_that_is_named_is_not_far_behind_the_axes(grbl: Grbl) -> None:
    """A laser burns twice what lies between the start of the line that is named and the axes. Moves in a straight row
    are one to the planner up to 1 mm, or to 1/64 of the way in which the fastest axis stops from its full rate
    (docs/motion.md)."""
    grbl.fine("$110=6000", "$120=500")
    merged_mm = max(1.0, 100.0**2 / (2 * 500) / 64)
    ends_mm = [
        0.0,
        *(round(0.3 * n, 3) for n in range(1, 101)),
        60.0,
        *(round(60 + 0.01 * n, 3) for n in range(1, 901)),
        80.0,
    ]
    lines = [f"N{n}G1X{x}F1200\n" for n, x in enumerate(ends_mm) if n]
    named, unanswered, status = set(), 0, ""
    while lines or "Idle" not in status:
        while lines and unanswered < 30:
            grbl.put(lines.pop(0))
            unanswered += 1
        unanswered -= grbl.after(0.005).count("ok\r\n")
        status = grbl.status()
        found = re.search(r"\|MPos:([\d.]+),.*\|Ln:(\d+)", status)
        if not found:
            continue
        x_mm, line = float(found[1]), int(found[2])
        named.add(line)
        assert ends_mm[line - 1] - 0.05 <= x_mm <= ends_mm[line] + merged_mm + 0.05, status
    assert len(named) > 40


def test_buffers_are_reported_truthfully(grbl: Grbl) -> None:
    """Never report more than is free: `Bf:` counts free blocks and free bytes, `[OPT:]` all of them."""
    grbl.fine("$10=3")
    moves = grbl.plan_moves
    assert f"|Bf:{moves},2048|" in grbl.status()
    assert re.search(rf"\[OPT:\w+,{moves},2048\]", grbl.send("$I\n"))
    grbl.after(0.05, "G1X-10F100\nY-11\nX-12\nM5\nM3\nG0X1Y1\n")
    blocks, free = map(int, re.search(r"Bf:(\d+),(\d+)", grbl.status()).groups())
    assert moves - 3 * 3 <= blocks <= moves - 3  # a move becomes three pieces of path at most
    assert free == 2048 - len("G0X1Y1\n")


def test_a_full_report_has_every_field_at_once(grbl: Grbl) -> None:
    """grblHAL's 0x87. What `?` gets, now and then, stays as it was."""
    grbl.status()
    for _ in range(3):
        full = grbl.send("\x87")
        assert "|WCO:0.000,0.000,0.000" in full and full.rstrip().endswith("|Ov:100,100,100|A:>")
    grbl.fine("$22=1", "M3S500M8")
    full = grbl.send("\x87")
    assert re.search(r"\|WCO:[^|]*\|H:0,0\|Ov:100,100,100\|A:SF>", full)
    assert grbl.send("G0\x87X0\n").rstrip().endswith("ok")  # in the middle of a line


def seldom(report: str) -> list[str]:
    """Fields that are not in each report."""
    return fields(report)[2:]


def test_intervals_while_idle(grbl: Grbl) -> None:
    """First report after reset carries WCO, second Ov. Idle: WCO every **10** reports (1, 11, 21, 31), Ov every **10**
    (2, 12, ...)."""
    grbl.send("\x18")
    shown = [seldom(grbl.status()) for _ in range(31)]
    assert [n for n, f in enumerate(shown, 1) if f == ["WCO"]] == [1, 11, 21, 31]
    assert [n for n, f in enumerate(shown, 1) if f == ["Ov"]] == [2, 12, 22]


def test_intervals_while_busy(grbl: Grbl) -> None:
    """Busy (Homing, Run, Hold, Jog, Door): WCO every **30**, Ov every **20**."""
    grbl.send("\x18")
    grbl.after(0.05, "G1X-30F300\n")
    shown = [seldom(grbl.after(0.01, "?")) for _ in range(64)]
    assert [n for n, f in enumerate(shown, 1) if f == ["WCO"]] == [1, 31, 61]
    assert [n for n, f in enumerate(shown, 1) if f == ["Ov"]] == [2, 22, 42, 62]


def test_a_change_forces_the_field(grbl: Grbl) -> None:
    """Change forces it at the next report; if both fall together WCO wins and Ov waits one."""
    for _ in range(4):
        grbl.status()
    grbl.fine("G92X1")
    assert "WCO:-1.000" in grbl.status()
    grbl.send("\x91")
    assert "Ov:110,100,100" in grbl.status()
    grbl.fine("G55")
    grbl.send("\x91")
    assert fields(grbl.status())[-1] == "WCO" and "Ov:120,100,100" in grbl.status()


@pytest.mark.parametrize(
    ("lines", "shown"),
    [
        ("M3S9M8", "A:SF"),
        pytest.param("M4S9", "A:C", marks=pytest.mark.needs("spindle_dir")),
        pytest.param("M7", "A:M", marks=pytest.mark.needs("coolant_mist")),
        ("M3S9M7M8", None),
        ("M5", ""),
    ],
)
def test_accessories(grbl: Grbl, lines: str, shown: str | None) -> None:
    """`A:` only inside an Ov report and only if something is on: `A:SF`, `A:C` (S and C exclusive)."""
    grbl.status()
    if shown is None:
        assert grbl.send(lines + "\n") == "error:21\r\n"
        return
    grbl.fine(lines)
    grbl.send("\x91\x90")
    report = grbl.status() + grbl.status()
    assert re.search(r"\|Ov:100,100,100(\|(A:\w+))?>", report)[2] == (shown or None)


@pytest.mark.needs("start", "hold", "reset", "door")
def test_pins(grbl: Grbl) -> None:
    """`Pn:` only when a pin is active, order P, X Y Z, D, R, H, S."""
    assert "Pn:" not in grbl.status()
    for name in ("start", "limit-max-z", "probe", "limit-min-x", "limit-y", "hold"):
        grbl.input(name, True)
    grbl.after(10e-6)  # $92
    assert "|Pn:PXYZHS" in grbl.status()
    grbl.input("reset", True)
    grbl.send("")
    assert "|Pn:PXYZRHS" in grbl.status()
    grbl.input("reset", False)
    grbl.input("door", True)
    assert "|Pn:PXYZDHS" in grbl.status()


def test_wco_is_the_sum(grbl: Grbl) -> None:
    """`WCO:` = WCS + G92 + TLO. MPos - WCO = WPos."""
    grbl.fine("G10L2P1X1Y2Z3", "G92.1", "G43.1Z4", "G92X10")
    grbl.fine("G53G0X1Y1Z1")
    assert "MPos:1.000,1.000,1.000" in (shown := grbl.status()) and "|WCO:-10.000,2.000,7.000" in shown
    grbl.fine("$10=0")
    assert "WPos:11.000,-1.000,-6.000" in grbl.status()


def test_inches(grbl: Grbl) -> None:
    """`$13=1`: positions 4 decimals, **rates 1 decimal** (`FS:7.6,0`) and the `$G` F (`F100.0` in G20)."""
    grbl.fine("$13=1")
    grbl.fine("G20", "F7.6")
    assert "F7.6" in grbl.send("$G\n")
    grbl.after(0.5, "G1X-1\n")
    assert re.match(r"<Run\|MPos:-\d\.\d{4},0\.0000,0\.0000\|FS:7\.6,0\|", grbl.status())


def test_feed_of_dollar_g_follows_13_not_g20(grbl: Grbl) -> None:
    """`G20` `F100` with $13=0 prints `F2540`."""
    grbl.fine("G20", "F100")
    assert " F2540 " in grbl.send("$G\n")


def test_parameters(grbl: Grbl) -> None:
    """`$#`: G54..G59, G28, G30, G92, `[TLO:z]`, `[PRB:x,y,z:0|1]`, then ok."""
    names = re.findall(r"\[(\w+):", grbl.send("$#\n"))
    assert names == ["G54", "G55", "G56", "G57", "G58", "G59", "G28", "G30", "G92", "TLO", "PRB"]
    assert grbl.send("$#\n").endswith("[TLO:0.000]\r\n[PRB:0.000,0.000,0.000:0]\r\nok\r\n")


def test_modes(grbl: Grbl) -> None:
    """`$G`: `[GC:G0 G54 G17 G21 G90 G94 M5 M9 T0 F0 S0]`; M7 and M8 both if on."""
    assert grbl.send("$G\n") == "[GC:G0 G54 G17 G21 G90 G94 M5 M9 T0 F0 S0]\r\nok\r\n"
    grbl.fine("M8")
    assert " M5 M8 T0 " in grbl.send("$G\n")


@pytest.mark.needs("coolant_mist")
def test_modes_with_both_coolants(grbl: Grbl) -> None:
    """`$G`: M7 and M8 both if on."""
    grbl.fine("M7", "M8")
    assert " M7 M8 " in grbl.send("$G\n")


def test_build_info(grbl: Grbl) -> None:
    """`$I`: `[VER:1.1h.20190830:STRING]`, `[OPT:...]`, ok; `$I=text` is stored upper-cased, blanks stripped."""
    grbl.fine("$I=hello world")
    version, options = r"\[VER:1\.1h\.20190830:HELLOWORLD\]\r\n", rf"\[OPT:V\w*,{grbl.plan_moves},2048\]\r\n"
    start = r"(\[START:[0-9A-F]{8}\]\r\n)?"  # a chip's
    assert re.fullmatch(rf"{version}{options}{start}ok\r\n", grbl.send("$I\n"))


def test_a_report_in_every_state(grbl: Grbl) -> None:
    """`?` works in every state but critical alarm (after ALARM:1/2 it prints only `[MSG:Reset to continue]`)."""
    seen = [grbl.state()]
    for seconds, data in ((0.2, "G1X-20F90\n"), (0.001, "!"), (1, ""), (0.001, "\x84"), (5, "~"), (0.2, "\x18")):
        grbl.after(seconds, data)
        seen.append(grbl.state())
    for seconds, data in ((0.6, ""), (0.1, "$X\n"), (0.1, "$C\n"), (0.1, "\x18"), (0.1, "$J=X0F100\n")):
        grbl.after(seconds, data)
        seen.append(grbl.state())
    grbl.send("\x85$SLP\n")
    seen.append(grbl.state())
    assert seen[:6] == ["Idle", "Run", "Hold:1", "Hold:0", "Door:0", "Run"]
    assert seen[-6:] == ["Alarm", "Idle", "Check", "Idle", "Jog", "Sleep"]


def test_one_answer_to_a_burst_of_questions(grbl: Grbl) -> None:
    """`????` in one burst gives one answer."""
    assert grbl.send("????").count("<") == 1


def test_soft_limit(grbl: Grbl) -> None:
    """Soft limit: `ALARM:2`, then `[MSG:Reset to continue]`, then only 0x18 works; position kept. (And reports.)"""
    grbl.fine("$22=1", "$20=1")
    said = grbl.send("G1F3000X-30\nX-20\nX-201\n")
    assert said == "ok\r\nok\r\nALARM:2\r\n[MSG:Reset to continue]\r\nerror:9\r\n"
    held = grbl.position()
    assert grbl.send("$X\nG0X0\n~!") == "error:9\r\n" * 2 and grbl.state() == "Alarm"
    assert grbl.send("\x18") == BANNER + LOCKED
    assert grbl.position() == held == grbl.stands()


def test_soft_limit_in_motion_stops_inside(grbl: Grbl) -> None:
    """2 soft limit: position kept; the motion under way comes to a controlled stop first."""
    grbl.fine("$22=1", "$20=1")
    grbl.after(0.3, "G1F3000X-30\n")
    said = grbl.send("G3X-50Y0I-10\nG0X5\n")
    assert "ALARM:2" in said
    assert -30 * 250 < grbl.position()[0] < 0 and grbl.position() == grbl.stands()


def test_alarm_is_followed_by_quiet(grbl: Grbl) -> None:
    r"""Alarms are `ALARM:n\r\n`; then a 500 ms quiet time."""
    grbl.after(0.2, "G1X-10F600\n")
    assert grbl.after(0.49, "\x18") == "ALARM:3\r\n"
    assert grbl.after(0.02) == BANNER + LOCKED


def test_reset_in_motion(grbl: Grbl) -> None:
    """Reset in motion: `ALARM:3`, banner, unlock message, locked; `$X` answers `[MSG:Caution: Unlocked]` + ok."""
    grbl.after(0.2, "G1X-10F600\n")
    assert grbl.send("\x18") == "ALARM:3\r\n" + BANNER + LOCKED
    assert grbl.position() == grbl.stands() and grbl.position()[0] != 0
    assert grbl.send("G0\n") == "error:9\r\n"
    assert grbl.send("$X\n") == "[MSG:Caution: Unlocked]\r\nok\r\n"
    assert grbl.send("G0X0\n") == "ok\r\n" and grbl.stands()[0] == 0


@pytest.mark.parametrize("before", ["", "!"])
def test_reset_at_rest(grbl: Grbl, before: str) -> None:
    """Reset in Idle or Hold:0: no alarm, position kept."""
    grbl.fine("G0X3")
    grbl.send(before)
    assert grbl.send("\x18") == BANNER and grbl.state() == "Idle" and grbl.position()[0] == 750
