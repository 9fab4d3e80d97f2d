"""M6 by $341, $TPW and $TLR, the tool setter's own input, M61, M1's switch, and Ln: of lines without an N word."""

from __future__ import annotations

import random
import re

import pytest
from grbl_host import Grbl
from test_parked import PARK, PARKED, QUICK, STEPS
from test_switches import make_homing

HOMED = (1000, 1007, 1014)  # true steps at machine 0, after make_homing() and $H
TOP = -500  # steps: a pull-off below the switches
SETTER = (-20, -25)  # machine mm
G59_3 = f"G10L2P9X{SETTER[0]}Y{SETTER[1]}Z-15"


def true_steps(axis: int, machine_mm: float) -> int:
    return round(machine_mm * STEPS) + HOMED[axis]


def place_setter(grbl: Grbl, top_mm: float) -> None:
    """A longer tool meets it earlier, which is as if it were higher."""
    grbl.toolsetter(*(true_steps(axis, SETTER[axis]) for axis in range(2)), true_steps(2, top_mm))


def homed(grbl: Grbl, mode: int, *lines: str) -> None:
    """Homed, at machine -10 -10 -10, with G54 there."""
    make_homing(grbl)
    grbl.settings(s20=1, s342=20, s343=50, s344=400, s345=1000, s57=2000)
    grbl.fine(*QUICK, "$H", G59_3, f"$341={mode}", "G53G0X-10Y-10Z-10", "G10L20P1X0Y0Z0", *lines)


def lines_of(said: str) -> list[str]:
    return [line for line in said.split("\r\n") if line]


def length(said: str) -> float:
    found = re.search(r"tool length: ([-\d.]+)", said, re.IGNORECASE)
    assert found, said
    return float(found[1])


# ---- the input ----


def test_the_tool_setter_stops_a_probing_move_that_chose_it(grbl: Grbl) -> None:
    """At its own edge, to the step; the probe's input is not looked at."""
    grbl.fine(*QUICK, "G65P5Q1")
    grbl.toolsetter(0, 0, -1234)
    grbl.surface(-100)
    assert grbl.send("G91G38.2Z-20F200\n") == "[PRB:0.000,0.000,-4.936:1]\r\nok\r\n"
    grbl.fine("G90G0Z0", "G65P5Q0")
    assert grbl.send("G91G38.2Z-20F200\n") == "[PRB:0.000,0.000,-0.400:1]\r\nok\r\n"


def test_a_reset_chooses_the_probe(grbl: Grbl) -> None:
    grbl.fine("G65P5Q1")
    grbl.send("\x18")
    grbl.surface(-100)
    assert grbl.send("G91G38.2Z-20F200\n") == "[PRB:0.000,0.000,-0.400:1]\r\nok\r\n"


def test_the_setters_polarity_is_its_own(grbl: Grbl) -> None:
    """$72: a normally closed setter; $6 is the probe's."""
    grbl.fine(*QUICK, "$72=1", "G65P5Q1")
    grbl.input("toolsetter", True)
    assert "|Pn:P" not in grbl.status()
    grbl.input_in(0.5, "toolsetter", False)
    assert "[PRB:0.000,0.000,-" in grbl.send("G91G38.2Z-20F200\n")
    assert "|Pn:P" in grbl.status()
    assert "ALARM:4" in grbl.send("G38.2Z-20\n")


def test_a_board_without_it_refuses() -> None:
    grbl = Grbl(ports=False)
    grbl.send("")
    assert grbl.send("G65P5Q1\n") == "error:136\r\n"
    assert grbl.send("G65P5Q0\n") == "ok\r\n"
    assert "|Pn:" not in grbl.status()
    grbl.close()


@pytest.mark.parametrize(("line", "error"), [("G65P5", 28), ("G65Q1", 28), ("G65P5Q2", 20), ("G65P6Q1", 20)])
def test_only_what_is_known_of_g65(grbl: Grbl, line: str, error: int) -> None:
    assert grbl.send(line + "\n") == f"error:{error}\r\n"


# ---- M6 ----


def test_the_message_has_the_lines_comment(grbl: Grbl) -> None:
    assert grbl.after(0.2, "T2M6 (6 mm [flat])\n") == "[MSG:Tool change: T2 6 mm (flat)]\r\n"
    assert grbl.after(0.2, "~") == "ok\r\n"
    assert grbl.after(0.2, "(not this one)\nT3 M6 ; (MSG, drill)\n") == "ok\r\n[MSG:Tool change: T3 (MSG, drill)]\r\n"
    grbl.after(0.2, "~")
    told = "[MSG:1 mm drill]\r\n[MSG:Tool change: T4 1 mm drill]\r\n"  # MSG: when the line is read
    assert grbl.after(0.2, "(MSG, 1 mm drill) T4 M6\n") == told
    grbl.after(0.2, "~")
    assert grbl.after(0.2, "(of another line)\n") == "ok\r\n"
    assert grbl.after(0.2, "M6\n") == "[MSG:Tool change: T4]\r\n"


def test_m6_that_is_ignored_switches_nothing(grbl: Grbl) -> None:
    grbl.fine("$341=4", "M3S500M8", "T3M6")
    assert grbl.state() == "Idle" and grbl.outputs().spindle_direction == 1 and grbl.outputs().coolant == 2
    assert " T3 " in grbl.send("$G\n")


def test_m61_names_the_tool_in_the_spindle(grbl: Grbl) -> None:
    grbl.fine("G10L1P7Z2.5", "M61Q7", "G43")
    assert " T7 " in grbl.send("$G\n") and "[TLO:2.500]" in grbl.send("$#\n")
    assert grbl.send("M61\n") == "error:28\r\n" and grbl.send("M61Q-1\n") == "error:4\r\n"


def test_g43_2_adds(grbl: Grbl) -> None:
    grbl.fine("G10L1P1Z2.5", "G10L1P2Z0.25", "G43H1", "G43.2H2")
    assert "[TLO:2.750]" in grbl.send("$#\n")
    grbl.fine("G49")
    assert "[TLO:0.000]" in grbl.send("$#\n")
    assert grbl.send("G43.2\n") == "error:28\r\n"


@pytest.mark.parametrize("mode", [1, 2, 3])
def test_a_machine_that_is_not_homed_refuses(grbl: Grbl, mode: int) -> None:
    grbl.fine(f"$341={mode}", "M3S500")
    assert grbl.send("T1M6\n") == "error:174\r\n"
    assert grbl.outputs().spindle_direction == 1 and " T0 " in grbl.send("$G\n")


@pytest.mark.parametrize("mode", [2, 3])
def test_a_setter_without_a_place_is_refused(grbl: Grbl, mode: int) -> None:
    homed(grbl, mode, "G10L2P9X0Y0Z0")
    assert grbl.send("T1M6\n") == "error:175\r\n"


def test_the_line_of_m6_sets_no_offset(grbl: Grbl) -> None:
    homed(grbl, 3, "G10L1P1Z1")
    assert grbl.send("T1M6G43H1\n") == "error:172\r\n" and grbl.state() == "Idle"


def test_touch_off_by_hand(grbl: Grbl) -> None:
    """$341=1: up, wait; jog, probe and zero with no 0xA3 by a sender that sends line by line; ~ returns."""
    homed(grbl, 1, "M3S500")
    grbl.surface(true_steps(2, -13))
    assert grbl.after(3, "T2M6\n") == "[MSG:Tool change: T2]\r\n"
    assert grbl.state() == "Tool" and grbl.position()[:3] == [-10 * STEPS, -10 * STEPS, TOP]
    assert grbl.outputs().spindle_direction == 0
    assert grbl.after(3, "$J=G91X-3Z-4F2000\n") == "ok\r\n"
    assert grbl.after(9, "G91\r\nG38.2 Z-20 F400\r\ng90\r\n").endswith("-13.000:1]\r\nok\r\nok\r\n")
    rested = grbl.position()[2]  # a little behind the contact
    assert grbl.after(1, "G10 L20 P0 Z5\n$J=G91Z8F2000\n") == "ok\r\nok\r\n"
    assert grbl.state() == "Tool"
    assert grbl.after(0.1, "~") == ""
    assert grbl.send("") == "ok\r\n"
    # The tool was at work Z0, and is there again.
    assert grbl.position()[:3] == [-10 * STEPS, -10 * STEPS, rested - 5 * STEPS] and grbl.state() == "Idle"


def test_tpw_measures_the_difference_to_the_first_tool(grbl: Grbl) -> None:
    homed(grbl, 1)
    grbl.surface(true_steps(2, -13))
    grbl.after(3, "T1M6\n")
    grbl.after(3, "$J=G91Z-6F2000\n")
    said = grbl.after(10, "$TPW\n")
    assert "[PRB:-10.000,-10.000,-13.000:1]" in said and "reference" in said and length(said) == 0
    assert said.endswith("ok\r\n") and grbl.position()[2] == TOP - 6 * STEPS, "back up to where it began"
    assert grbl.after(5, "~") == "ok\r\n"
    assert grbl.position()[2] == -10 * STEPS
    grbl.surface(true_steps(2, -13 + 3.2))  # the next tool is 3.2 mm longer
    grbl.after(3, "T2M6\n")
    grbl.after(3, "$J=G91Z-3F2000\n")
    assert length(grbl.after(10, "$TPW\n")) == 3.2
    assert grbl.after(8, "~") == "ok\r\n"
    assert grbl.position()[2] == round(-6.8 * STEPS)
    grbl.fine("G0Z0")
    assert grbl.position()[2] == round(-6.8 * STEPS)


@pytest.mark.parametrize("restore", [1, 0])
def test_the_tool_setter_measures_each_tool(grbl: Grbl, restore: int) -> None:
    """$341=3: up, wait, ~: to G59.3, two touches, back; by the setter's input, whatever the probe's says."""
    homed(grbl, 3, f"$346={restore}")
    grbl.surface(true_steps(2, -5))
    for tool, longer in ((1, 0.0), (2, 3.2), (3, -1.5)):
        place_setter(grbl, -22 + longer)
        assert grbl.after(3, f"T{tool}M6\n") == f"[MSG:Tool change: T{tool}]\r\n"
        assert grbl.state() == "Tool" and grbl.position()[2] == TOP
        said = grbl.after(25, "~")
        assert length(said) == longer and said.endswith("ok\r\n"), said
        assert f"[PRB:{SETTER[0]:.3f},{SETTER[1]:.3f},{-22 + longer:.3f}:1]" in said
        back = [-10 * STEPS, -10 * STEPS, round((-10 + longer) * STEPS)]
        assert grbl.position()[:3] == (back if restore else [SETTER[0] * STEPS, SETTER[1] * STEPS, TOP])
        grbl.fine("G90G0X0Y0Z0")
        assert grbl.position()[:3] == back
    grbl.send("\x18")
    grbl.fine("G0Z0")
    assert grbl.position()[2] == -10 * STEPS, "a reset forgets tool lengths"


def test_the_way_to_the_setter_is_up_across_and_down(grbl: Grbl) -> None:
    homed(grbl, 3)
    place_setter(grbl, -22)
    grbl.after(3, "T1M6\n")
    grbl.after(0.01, "~")
    seen = []
    for _ in range(2500):
        grbl.after(0.01)
        seen.append(grbl.stands()[:3])
    across = [z for x, y, z in seen if x not in (true_steps(0, -10), true_steps(0, SETTER[0]))]
    assert across and set(across) == {TOP + HOMED[2]}
    assert min(z for *_, z in seen) < true_steps(2, -22)


def test_a_setter_that_is_not_touched_keeps_the_tool_change(grbl: Grbl) -> None:
    homed(grbl, 3)
    grbl.after(3, "T1M6\n")
    said = grbl.after(25, "~")
    assert said == "[MSG:Tool not measured: no contact within $342]\r\n" and grbl.state() == "Tool"
    place_setter(grbl, -14)
    assert grbl.after(25, "~") == "[MSG:Tool not measured: it touched above Z of G59.3]\r\n"
    place_setter(grbl, -22)
    assert grbl.after(25, "~").endswith("ok\r\n") and grbl.state() == "Idle"


def test_a_length_set_by_hand_is_not_measured_again(grbl: Grbl) -> None:
    homed(grbl, 3)
    grbl.after(3, "T1M6\n")
    assert grbl.after(1, PARK + "G43.1Z2\n") == PARKED + "ok\r\n"
    assert grbl.after(6, "~") == "ok\r\n"
    assert grbl.position()[2] == -8 * STEPS


@pytest.mark.parametrize("when", [0.2, 1.0, 2.5, 4.0])
@pytest.mark.parametrize("stop", ["!", "door"])
def test_a_stop_on_the_way_leaves_the_rest_out(grbl: Grbl, when: float, stop: str) -> None:
    homed(grbl, 3)
    place_setter(grbl, -22)
    grbl.after(3, "T1M6\n")
    grbl.after(when, "~")
    said = grbl.after(1, "!" if stop == "!" else "\x84")
    if stop == "door":
        said += grbl.after(7, "~")
    assert said.endswith("[MSG:Tool not measured: stopped]\r\n") and grbl.state() == "Tool"
    assert grbl.position() == grbl.position()
    at = grbl.position()
    assert grbl.after(2) == "" and grbl.position() == at
    assert grbl.after(25, "~").endswith("ok\r\n") and grbl.state() == "Idle"
    assert grbl.position()[:3] == [-10 * STEPS] * 3


@pytest.mark.parametrize("when", [0.1, 0.5, 5.0, 9.0])
def test_a_reset_ends_it(grbl: Grbl, when: float) -> None:
    homed(grbl, 3)
    place_setter(grbl, -22)
    grbl.after(when if when < 1 else 3, "T1M6\n")
    if when > 1:
        grbl.after(when, "~")
    assert "Grbl 1.1h" in grbl.after(2, "\x18")
    grbl.after(1, "$X\n")
    at = grbl.position()
    assert grbl.after(2, "~") == "" and grbl.position() == at
    assert grbl.send("G91G1X1F600\n") == "ok\r\n" and grbl.position()[0] == at[0] + STEPS


def test_the_jobs_lines_wait_for_the_resume(grbl: Grbl) -> None:
    """A character-counting sender: what it has sent before the operator's lines is never taken for theirs."""
    homed(grbl, 1)
    assert grbl.after(3, "T1M6\nG0X1\nM3S100\n") == "[MSG:Tool change: T1]\r\n"
    assert grbl.after(2, "$J=G91Z-1F1000\n") == "" and grbl.position()[2] == TOP
    assert grbl.outputs().spindle_direction == 0
    assert grbl.after(1, PARK + "$J=G91Z-1F1000\n") == PARKED + "ok\r\n" and grbl.position()[2] == TOP - STEPS
    grbl.after(0.1, "~")
    assert grbl.send("") == "ok\r\n" * 4
    assert grbl.position()[0] == -9 * STEPS


@pytest.mark.parametrize("line", ["G0X1", "M3S100", "G1X1F100", "G91 M3 S100", "S500", "M30", "G38.2Z-5F100", "T2"])
def test_a_line_that_may_be_the_jobs_is_not_the_operators(grbl: Grbl, line: str) -> None:
    """Nothing starts under the operator's hands."""
    homed(grbl, 1)
    grbl.after(3, "T1M6\n")
    if "G38" not in line:  # after a jog the operator may probe
        assert grbl.after(1, "$J=G91Z-1F1000\n") == "ok\r\n"
    at = grbl.position()
    assert grbl.after(2, line + "\n") in ("", "error:170\r\n")
    assert grbl.position() == at and grbl.outputs().spindle_direction == 0 and grbl.state() == "Tool"


def test_what_is_the_operators_is_answered_before_the_job(grbl: Grbl) -> None:
    homed(grbl, 1)
    grbl.after(3, "T1M6\r\n")
    assert grbl.after(1, "$J=G91Z-1F1000\r\n") == "ok\r\n"
    assert grbl.after(1, "$#\r\n").startswith("[G54:")
    assert grbl.after(1, "G0X1\r\n$J=G91Z-1F1000\r\n") == ""
    grbl.after(0.1, "~")
    assert grbl.send("").startswith("ok\r\nok\r\n")


# ---- M1 ----


def test_m1_pauses_while_its_switch_is_on(grbl: Grbl) -> None:
    assert grbl.send("M1\n") == "ok\r\n"
    assert grbl.after(0.1, "\x88") == "" and "|Pn:T" in grbl.status()
    assert grbl.after(0.5, "G1X1F600M1\nX2\n") == "" and grbl.state() == "Hold:0"
    assert grbl.position()[0] == STEPS
    assert grbl.send("~") == "ok\r\nok\r\n" and grbl.position()[0] == 2 * STEPS
    grbl.send("\x18")
    assert "|Pn:T" in grbl.status(), "a switch stays where it is"
    grbl.after(0.1, "\x88")
    assert "|Pn:" not in grbl.status() and grbl.send("M1\n") == "ok\r\n"
    grbl.after(0.1, "\x88\x88")
    assert "|Pn:" not in grbl.status()


def test_m1_has_a_switch_at_an_input(grbl: Grbl) -> None:
    grbl.fine("$747=1")
    assert "|Pn:" not in grbl.status() and grbl.send("M1\n") == "ok\r\n"
    grbl.input("input-0", True)
    grbl.after(0.05)
    assert "|Pn:T" in grbl.status()
    assert grbl.after(0.5, "G1X1F600M1\nX2\n") == "" and grbl.state() == "Hold:0"
    assert grbl.send("~") == "ok\r\nok\r\n" and grbl.position()[0] == 2 * STEPS
    grbl.fine("$748=1")  # on while the line is low
    assert "|Pn:" not in grbl.status() and grbl.send("M1\n") == "ok\r\n"
    grbl.input("input-0", False)
    grbl.after(0.05)
    assert "|Pn:T" in grbl.status()
    assert grbl.after(0.1, "M1\n") == "" and grbl.state() == "Hold:0"
    grbl.input("input-0", True)  # off again: the pause that has begun waits for ~
    assert grbl.after(0.1) == "" and grbl.state() == "Hold:0" and grbl.send("~") == "ok\r\n"
    grbl.after(0.1, "\x88")
    assert "|Pn:T" in grbl.status(), "the byte's switch is another one: one of them is enough"


@pytest.mark.parametrize("glitch_s", [1e-5, 1e-4])
def test_a_glitch_of_m1s_switch_never_passes_m1(glitch_s: float) -> None:
    """Whenever it comes: the board looks once a millisecond, so it sees it once at most."""
    for at in range(40):
        grbl = Grbl()
        grbl.send("")
        grbl.fine("$747=1")
        grbl.input("input-0", True)
        grbl.after(0.05)
        grbl.input_in(1e-4 * at, "input-0", False)
        grbl.input_in(1e-4 * at + glitch_s, "input-0", True)
        assert grbl.after(0.1, "G4P0.002\nM1\n") == "ok\r\n" and grbl.state() == "Hold:0", at
        grbl.close()


# ---- Ln: ----


def executed(grbl: Grbl, seconds: float) -> list[int]:
    """Numbers in the order in which reports name them."""
    seen: list[int] = []
    for _ in range(round(seconds / 0.02)):
        grbl.after(0.02)
        found = re.search(r"\|Ln:(\d+)", grbl.status())
        if found and (not seen or seen[-1] != int(found[1])):
            seen.append(int(found[1]))
    return seen


def test_reports_number_lines_without_an_n_word(grbl: Grbl) -> None:
    """$10=5: the place in the program, as the lines came; $ lines are none of it. An N word is as it is."""
    grbl.fine("$10=5")
    grbl.send("\x18")
    grbl.after(0.01, "%\n(a part)\nG1X2F600\n\nY2\n$G\nX0\nN70Y0\n")
    assert executed(grbl, 2.0) == [3, 5, 6, 70]
    grbl.send("M30\n")
    grbl.after(0.01, "G1X2F600\nX0\n")
    assert executed(grbl, 1.0) == [1, 2]
    grbl.after(0.01, "%\nG1X2\n")
    assert executed(grbl, 1.0) == [2]


def test_without_the_bit_only_n_words_are_reported(grbl: Grbl) -> None:
    grbl.after(0.01, "G1X2F600\nN7X0\n")
    assert executed(grbl, 1.0) == [7]


# ---- in any order ----

ANYTHING = (
    *("~", "~", "~", "!", "\x85", "\x84", PARK, "\x88", "\x9e", "\xa0", "?"),
    *("T1M6\n", "T2M6G0X1\n", "M0\n", "M1\n", "$TPW\n", "$TPW\n", "$TLR\n", "$J=G91Z-2F1500\n", "$J=G91X-2F1500\n"),
    *("G91G38.3Z-3F300\n", "G10L20P0Z1\n", "G43.1Z1\n", "G90G0X-2\n", "G1Z-1F800\n", "M3S400M8\n", "M5\n", "G4P0.1\n"),
    *("$341=0\n", "$341=1\n", "$341=2\n", "$341=3\n", "$42=1\n", "$42=2\n", "$42=0\n", "$346=0\n", "$X\n", "G65P5Q1\n"),
)


@pytest.mark.parametrize("seed", range(24))
def test_anything_in_any_order(seed: int) -> None:
    """The monitor looks on: no step where none may be, limits, the counter, an answer for each line; then a reset, and
    the machine is where its pulses say."""
    rng, grbl = random.Random(seed), Grbl()
    grbl.send("")
    homed(grbl, rng.choice((1, 2, 3, 3)), "$394=0.5")
    place_setter(grbl, -22)
    grbl.surface(true_steps(2, -26))
    for _ in range(60):
        if rng.random() < 0.1:
            grbl.input("door", rng.random() < 0.4)
        if rng.random() < 0.02:
            grbl.lose_sender()
        grbl.after(rng.choice((0.001, 0.02, 0.3, 1.0, 4.0)), rng.choice(ANYTHING))
    grbl.input("door", False)
    grbl.after(6, "~")
    grbl.after(2, "\x18")
    grbl.after(1, "$X\n")
    offset = [a - b for a, b in zip(grbl.stands(), grbl.position(), strict=True)]
    assert offset[:3] == list(HOMED), "the counter is the pulses"
    assert grbl.after(1, "$J=G91X1F600\n") in ("ok\r\n", "error:15\r\n")
    grbl.close()
