"""A spindle needs time: $394 after it was switched on, $539 after it was switched off, and $340, which waits for the
measured speed. Virtual time."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from grbl_host import Grbl
from lathe import Lathe

ON_S, OFF_S = 1.5, 2.5
STEPS_MM = 250
SLACK_S = 0.1  # until the first step of a move is seen
MOVE = "G91G1X-2F1200\n"
PATIENCE_S = 10.0
STEADY_S = 0.2
RAMP_RPM_S = 2000


def begins_after(grbl: Grbl, lines: str, seconds: float, move: str = MOVE) -> None:
    """The move behind these lines begins after this time."""
    before = grbl.stands()
    if seconds > 0:
        grbl.after(seconds - SLACK_S, lines + move)
        assert grbl.stands() == before
        assert grbl.state() == "Run"
        grbl.after(2 * SLACK_S)
    else:
        grbl.after(SLACK_S, lines + move)
    assert grbl.stands() != before


@pytest.fixture
def slow(grbl: Grbl) -> Grbl:
    """A spindle with both delays."""
    grbl.fine(f"$394={ON_S}", f"$539={OFF_S}")
    return grbl


@pytest.fixture
def lathe() -> Iterator[Lathe]:
    """The virtual spindle has an encoder and gains 2000 rpm a second."""
    controller = Lathe()
    controller.fine("$340=5")
    yield controller
    controller.close()


# --- delays ---


@pytest.mark.parametrize("on", ["M3S500", "M4S500", "M3", "S500M3"])
def test_switched_on(slow: Grbl, on: str) -> None:
    begins_after(slow, on + "\n", ON_S)


def test_the_spindle_turns_while_the_program_waits(slow: Grbl) -> None:
    slow.after(0.1, "M3S500\n")
    assert slow.outputs().spindle_duty > 0


def test_a_move_of_the_same_line_waits(slow: Grbl) -> None:
    slow.fine("G91F1200")
    begins_after(slow, "", ON_S, "M3S500G1X-2\n")


@pytest.mark.parametrize(("s", "waits"), [(540, False), (460, False), (560, True), (440, True), (0, True)])
def test_s_waits_from_ten_percent(slow: Grbl, s: int, waits: bool) -> None:
    slow.fine("M3S500")
    begins_after(slow, f"S{s}\n", ON_S if waits else 0)


def test_small_changes_of_s_add_up(slow: Grbl) -> None:
    slow.fine("M3S500", "S540")
    begins_after(slow, "S580\n", ON_S)


def test_switched_off(slow: Grbl) -> None:
    slow.fine("M3S500")
    begins_after(slow, "M5\n", OFF_S)


@pytest.mark.parametrize("end", ["M2", "M30"])
def test_end_of_program(slow: Grbl, end: str) -> None:
    """Its `ok` comes when the spindle is still."""
    slow.fine("M3S500")
    answer, seconds = slow.answer_to(end)
    assert "Pgm End" in answer
    assert slow.outputs().spindle_duty == 0
    assert slow.send("") == "ok\r\n"
    assert seconds < OFF_S < slow.time()


def test_tool_change(slow: Grbl) -> None:
    """The operator is asked when the spindle is still."""
    slow.fine("M3S500")
    said = slow.after(OFF_S - SLACK_S, "T2M6\n")
    assert said == "" and slow.state() == "Run" and slow.outputs().spindle_duty == 0
    assert "[MSG:" in slow.after(2 * SLACK_S)
    assert slow.state() == "Hold:0"


@pytest.mark.parametrize(("first", "second"), [("M3", "M4"), ("M4", "M3")])
def test_reversal_stops_first(slow: Grbl, first: str, second: str) -> None:
    slow.fine(first + "S500")
    turned = slow.outputs().spindle_direction
    slow.after(OFF_S - SLACK_S, second + "\n")
    assert slow.outputs().spindle_duty == 0 and slow.outputs().spindle_direction == 0
    slow.after(2 * SLACK_S)
    assert slow.outputs().spindle_duty > 0 and slow.outputs().spindle_direction == -turned
    begins_after(slow, "", ON_S - SLACK_S)


def test_reversal_keeps_coolant(slow: Grbl) -> None:
    slow.fine("M3S500M8")
    slow.after(OFF_S / 2, "M4M9\n")
    assert slow.outputs().coolant == 2
    slow.after(OFF_S)
    assert slow.outputs().coolant == 0


def test_reversal_after_a_reset_stops_first(slow: Grbl) -> None:
    """A reset switches the spindle off, and it turns on for a while."""
    slow.fine("M3S500")
    slow.after(1.0, "\x18")
    slow.after(OFF_S - 1.0 - SLACK_S, "M4S500\n")
    assert slow.outputs().spindle_duty == 0
    slow.after(2 * SLACK_S)
    assert slow.outputs().spindle_duty > 0


def test_same_direction_after_a_reset(slow: Grbl) -> None:
    slow.fine("M3S500")
    slow.after(0.1, "\x18")
    slow.after(0.1, "M3S500\n")
    assert slow.outputs().spindle_duty > 0


@pytest.mark.parametrize("lines", ["", "M5\n", "M8\n", "S700\n", "G4P0\n"])
def test_a_spindle_that_is_off_waits_for_nothing(slow: Grbl, lines: str) -> None:
    begins_after(slow, lines, 0)


@pytest.mark.parametrize("lines", ["M3\n", "S500\n", "M3S500\n", "M8\n"])
def test_nothing_changes(slow: Grbl, lines: str) -> None:
    slow.fine("M3S500")
    begins_after(slow, lines, 0)


@pytest.mark.parametrize("lines", ["M3S500\n", "M4S500\n", "M3S500\nM5\n", "M3S500\nM4S900\n"])
def test_a_laser_needs_no_time(slow: Grbl, lines: str) -> None:
    slow.fine("$32=1")
    begins_after(slow, lines, 0)


def test_default_is_no_wait(grbl: Grbl) -> None:
    begins_after(grbl, "M3S500\nS900\nM5\nM4S100\n", 0)


@pytest.mark.parametrize(("coolant_s", "seconds"), [(0.5, ON_S), (3.0, 3.0)])
def test_coolant_and_spindle_start_together(slow: Grbl, coolant_s: float, seconds: float) -> None:
    slow.fine(f"$93={coolant_s}")
    begins_after(slow, "M3S500M8\n", seconds)


def until_duty(grbl: Grbl, on: bool) -> None:
    for _ in range(2000):
        if (grbl.outputs().spindle_duty > 0) == on:
            return
        grbl.after(0.01)
    raise AssertionError(grbl.status())


def test_a_boring_cycle(slow: Grbl) -> None:
    """G86 leaves the hole with a spindle that is still, and the next hole begins with one at speed."""
    slow.fine("G90", "M3S500")
    slow.put("G86X-1Z-2R-1P0F1200\n")
    until_duty(slow, on=False)
    bottom = -2 * STEPS_MM
    slow.after(OFF_S - SLACK_S)
    assert slow.stands()[2] == bottom
    until_duty(slow, on=True)
    assert slow.stands()[2] > bottom
    begins_after(slow, "", ON_S, MOVE)


def test_check_mode_does_not_wait(slow: Grbl) -> None:
    assert slow.send("$C\n") == "[MSG:Enabled]\r\nok\r\n"
    assert slow.after(0.2, "M3S500\nM4\nS900\nM5\n" + MOVE + "M30\n").count("ok") == 6


@pytest.mark.parametrize("line", ["$394=60.1", "$539=60.1", "$340=51"])
def test_out_of_range(grbl: Grbl, line: str) -> None:
    assert grbl.send(line + "\n") == "error:2\r\n"


# --- what comes while it waits ---


def test_a_hold_stops_the_wait(slow: Grbl) -> None:
    """As G4: the time does not run in a hold."""
    before = slow.stands()
    slow.after(0.5, "M3S500\n" + MOVE)
    slow.after(5.0, "!")
    assert slow.state() == "Hold:0" and slow.stands() == before
    slow.after(0.8, "~")
    assert slow.stands() == before
    slow.after(0.4)
    assert slow.stands() != before


def test_a_reset_ends_it(slow: Grbl) -> None:
    slow.fine("$394=60")
    slow.after(0.2, "M3S500\n")
    said = slow.after(0.2, "\x18")
    assert slow.outputs().spindle_duty == 0 and "ALARM" not in said
    begins_after(slow, "", 0)


def test_an_estop_ends_it(slow: Grbl) -> None:
    slow.after(0.2, "M3S500\n" + MOVE)
    slow.input("estop", True)
    assert "ALARM:50" in slow.after(0.01)
    assert slow.outputs().spindle_duty == 0


def test_the_door_ends_it(slow: Grbl) -> None:
    slow.after(0.2, "M3S500\n" + MOVE)
    slow.after(0.1, "\x84")
    assert slow.state() == "Door:0" and slow.outputs().spindle_duty == 0


def test_an_override_neither_shortens_nor_prolongs_it(slow: Grbl) -> None:
    before = slow.stands()
    slow.after(0.5, "M3S500\n" + MOVE)
    slow.after(ON_S - 0.5 - SLACK_S, "\x9a\x9a\x9a")
    assert slow.stands() == before
    slow.after(2 * SLACK_S)
    assert slow.stands() != before


def test_an_override_while_the_spindle_turns_waits_for_nothing(slow: Grbl) -> None:
    slow.fine("M3S500")
    begins_after(slow, "\x9a\x9a\x9a", 0)


def test_spindle_stop_means_nothing_outside_a_hold(slow: Grbl) -> None:
    slow.after(0.5, "M3S500\n" + MOVE)
    slow.after(0.1, "\x9e")
    assert slow.outputs().spindle_duty > 0


# --- back from a hold or a door ---


def test_a_closed_door_waits_as_the_program(slow: Grbl) -> None:
    """$394 instead of Grbl's 4 s."""
    slow.fine("M3S500")
    slow.after(1.0, MOVE.replace("X-2", "X-100"))
    slow.after(2.0, "\x84")
    stood = slow.stands()
    slow.after(ON_S - SLACK_S, "~")
    assert slow.state() == "Door:3" and slow.stands() == stood and slow.outputs().spindle_duty > 0
    slow.after(2 * SLACK_S)
    assert slow.state() == "Run" and slow.stands() != stood


def held(grbl: Grbl) -> list[int]:
    grbl.fine("M3S500")
    grbl.after(1.0, MOVE.replace("X-2", "X-100"))
    grbl.after(1.0, "!")
    return grbl.stands()


def stopped_in_hold(grbl: Grbl) -> list[int]:
    stood = held(grbl)
    grbl.after(1.0, "\x9e")
    assert grbl.outputs().spindle_duty == 0
    return stood


def test_a_spindle_stopped_in_a_hold_runs_up_first(slow: Grbl) -> None:
    stood = stopped_in_hold(slow)
    slow.after(ON_S - SLACK_S, "~")
    assert slow.outputs().spindle_duty > 0 and slow.state() == "Hold:0" and slow.stands() == stood
    slow.after(2 * SLACK_S)
    assert slow.state() == "Run" and slow.stands() != stood


def test_without_a_delay_it_continues_immediately(grbl: Grbl) -> None:
    """As Grbl."""
    stood = stopped_in_hold(grbl)
    grbl.after(SLACK_S, "~")
    assert grbl.state() == "Run" and grbl.stands() != stood


def test_a_spindle_stopped_in_a_hold_turns_again_behind_a_closed_door(slow: Grbl) -> None:
    stopped_in_hold(slow)
    slow.after(1.0, "\x84")
    slow.after(0.5, "~")
    assert slow.outputs().spindle_duty > 0
    slow.after(ON_S)
    assert slow.state() == "Run" and slow.outputs().spindle_duty > 0


@pytest.mark.parametrize("keys", ["\x9e", "\x9e\x9e", ""])
def test_a_lost_senders_spindle_turns_again_before_its_motion(slow: Grbl, keys: str) -> None:
    """0x9E means nothing when the spindle is off already; and one that was off before comes back, too."""
    slow.fine("$75=0.1")
    stood = stopped_in_hold(slow) if not keys else held(slow)
    slow.lose_sender()
    slow.after(1.0)
    for key in keys:
        slow.after(0.1, key)
    assert slow.outputs().spindle_duty == 0
    slow.after(0.5, "~")
    assert slow.outputs().spindle_duty > 0 and slow.stands() == stood
    slow.after(ON_S)
    assert slow.state() == "Run" and slow.outputs().spindle_duty > 0 and slow.stands() != stood


def test_started_again_in_the_hold(slow: Grbl) -> None:
    """What remains of the delay when `~` comes."""
    stood = stopped_in_hold(slow)
    slow.after(1.0, "\x9e")
    slow.after(ON_S - 1.0 - SLACK_S, "~")
    assert slow.stands() == stood
    slow.after(2 * SLACK_S)
    assert slow.stands() != stood


def test_a_hold_that_only_held_waits_for_nothing(slow: Grbl) -> None:
    slow.fine("M3S500")
    slow.after(1.0, MOVE.replace("X-2", "X-100"))
    slow.after(1.0, "!")
    stood = slow.stands()
    slow.after(SLACK_S, "~")
    assert slow.stands() != stood


@pytest.mark.parametrize("key", ["!", "\x9e"])
def test_a_hold_ends_the_run_up_and_the_next_start_waits_again(slow: Grbl, key: str) -> None:
    stood = stopped_in_hold(slow)
    slow.after(0.5, "~")
    slow.after(3.0, key)
    assert slow.state() == "Hold:0" and slow.stands() == stood
    assert (slow.outputs().spindle_duty > 0) == (key == "!")
    slow.after(0.5, "~")
    slow.after(ON_S)
    assert slow.state() == "Run" and slow.stands() != stood and slow.outputs().spindle_duty > 0


# --- at speed ---


@pytest.mark.parametrize("on", ["M3S2000", "M4S2000"])
def test_the_measured_speed_counts(lathe: Lathe, on: str) -> None:
    begins_after(lathe, on + "\n", 2000 * 0.95 / RAMP_RPM_S + STEADY_S)


def test_every_change_of_s_is_checked(lathe: Lathe) -> None:
    lathe.fine("M3S1000")
    begins_after(lathe, "S1080\n", STEADY_S + 0.02)


def test_the_delay_comes_first(lathe: Lathe) -> None:
    lathe.fine("$394=3")
    begins_after(lathe, "M3S2000\n", 3.0)


def test_a_spindle_that_does_not_come_to_speed(lathe: Lathe) -> None:
    lathe.spindle_load(20)
    lathe.put("M3S1000\n" + MOVE)
    assert "ALARM" not in lathe.after(PATIENCE_S - SLACK_S)
    said = lathe.after(2 * SLACK_S)
    assert "[MSG:Spindle not at speed: 800 rpm measured, 1000 rpm commanded]\r\nALARM:51" in said
    assert lathe.outputs().spindle_duty == 0 and lathe.stands() == [0] * 6
    said = lathe.after(1.0, "\x18")
    assert "Grbl 1.1h" in said and "ALARM" not in said


def test_the_wrong_direction_is_not_at_speed(lathe: Lathe) -> None:
    lathe.fine("M3S1000")
    lathe.after(0.3, "M4\n" + MOVE)  # no $539: it is reversed immediately
    assert lathe.stands() == [0] * 6 and lathe.spindle_rpm() > 0


def test_the_override_counts(lathe: Lathe) -> None:
    """At speed is S with the override."""
    lathe.after(0.1, "\x9a\x9a")
    begins_after(lathe, "M3S1000\n", 1200 * 0.95 / RAMP_RPM_S + STEADY_S)


def test_a_hold_stops_the_patience(lathe: Lathe) -> None:
    lathe.spindle_load(20)
    lathe.after(5.0, "M3S1000\n" + MOVE)
    lathe.after(20.0, "!")
    assert lathe.state() == "Hold:0"
    lathe.spindle_load(0)
    lathe.after(1.0, "~")
    assert lathe.stands() != [0] * 6


def test_a_closed_door_waits_for_the_speed(lathe: Lathe) -> None:
    """Instead of Grbl's 4 s."""
    lathe.fine("M3S2000")
    lathe.after(1.0, MOVE.replace("X-2", "X-100"))
    lathe.after(2.0, "\x84")
    stood = lathe.stands()
    lathe.after(0.95 + STEADY_S - SLACK_S, "~")
    assert lathe.state() == "Door:3" and lathe.stands() == stood
    lathe.after(2 * SLACK_S)
    assert lathe.stands() != stood


def test_a_closed_door_and_a_spindle_that_is_stuck(lathe: Lathe) -> None:
    lathe.fine("M3S2000")
    lathe.after(1.0, MOVE.replace("X-2", "X-100"))
    lathe.after(2.0, "\x84")
    lathe.spindle_load(50)
    said = lathe.after(PATIENCE_S + 0.1, "~")
    assert "ALARM:51" in said and lathe.outputs().spindle_duty == 0


@pytest.mark.parametrize("off", ["$340=0", "$88=0"])
def test_off(lathe: Lathe, off: str) -> None:
    lathe.fine(off)
    begins_after(lathe, "M3S2000\n", 0)


def test_s0_is_no_speed(lathe: Lathe) -> None:
    begins_after(lathe, "M3S0\n", 0)


def test_check_mode_measures_nothing(lathe: Lathe) -> None:
    assert lathe.send("$C\n") == "[MSG:Enabled]\r\nok\r\n"
    assert lathe.after(0.2, "M3S500\n" + MOVE).count("ok") == 2
