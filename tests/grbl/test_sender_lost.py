"""The connection of the sender that commands has ended: nothing moves, burns or turns on unattended."""

from __future__ import annotations

import pytest
from grbl_host import BANNER, LOCKED, Grbl
from test_switches import make_homing

HELD = "[MSG:Sender lost: feed hold]\r\n"
NOTICE = "Sender lost: feed hold"
RUN_UP_S, COOLANT_S = 4.0, 1.0


@pytest.fixture(autouse=True)
def tools_that_stop_soon(grbl: Grbl) -> None:
    grbl.fine("$75=0.0000001")


def test_a_jog_is_cancelled(grbl: Grbl) -> None:
    """As by 0x85; jogs that wait do not run."""
    grbl.after(0.3, "$J=G91X-100F3000\n" + "$J=G91Y-5F3000\n" * 40)
    at = grbl.position()[0]
    grbl.lose_sender()
    said = grbl.send("")
    assert grbl.state() == "Idle" and grbl.notice() is None and "Hold" not in said
    assert said.endswith("[MSG:Sender lost: jog cancelled]\r\n" + "ok\r\n" * said.count("ok\r\n"))
    assert 0 < at - grbl.position()[0] < 250 * 5 and grbl.position()[1] == 0 and grbl.position() == grbl.stands()


def test_a_program_is_held_and_its_tools_stop(grbl: Grbl) -> None:
    """What was accepted stays; spindle and coolant stop after the motion; `~` restores them as after the door."""
    grbl.fine("M3S500M8")
    grbl.after(0.3, "G1X-30F1000\nY-5\n")
    grbl.lose_sender()
    assert grbl.after(0.001) == HELD and grbl.state() == "Hold:1"
    assert grbl.outputs().spindle_direction == 1, "the cutter turns while it is in the work and moves"
    assert grbl.after(1) == "" and grbl.state() == "Hold:0"
    assert (grbl.outputs().spindle_direction, grbl.outputs().coolant) == (0, 0)
    held = grbl.position()
    grbl.after(3600)
    assert grbl.position() == held and grbl.state() == "Hold:0" and grbl.notice() == NOTICE
    grbl.after(RUN_UP_S - 0.1, "~")
    assert (grbl.outputs().spindle_direction, grbl.outputs().coolant) == (1, 0) and grbl.position() == held
    grbl.after(0.2)
    assert grbl.outputs().coolant == 2 and grbl.position() == held
    grbl.send("")
    assert grbl.position()[:2] == [-7500, -1250] and grbl.state() == "Idle" and grbl.notice() is None
    assert " M3 M8 " in grbl.send("$G\n")


@pytest.mark.parametrize("job", ["M3S500\n", "M8\n", "M7\n", "M3S500\nG1X-1F3000\n"])
def test_outputs_do_not_stay_on_at_rest(grbl: Grbl, job: str) -> None:
    grbl.send(job)
    assert grbl.state() == "Idle"
    grbl.lose_sender()
    assert grbl.send("") == HELD and grbl.state() == "Hold:0"
    assert (grbl.outputs().spindle_direction, grbl.outputs().coolant) == (0, 0)
    grbl.send("~")
    assert grbl.state() == "Idle" and (grbl.outputs().spindle_direction, grbl.outputs().coolant) != (0, 0)


def test_at_rest_with_nothing_on_nothing_happens(grbl: Grbl) -> None:
    """Clients come, ask and go."""
    grbl.lose_sender()
    assert grbl.send("") == "" and grbl.state() == "Idle" and grbl.notice() is None


def test_lines_that_wait_do_not_run(grbl: Grbl) -> None:
    """In the controller's buffer, or still before it."""
    grbl.put("G0X-1\nG0X-2\n")
    grbl.lose_sender()
    assert HELD in grbl.send("") and grbl.state().startswith("Hold") and grbl.position()[0] == 0
    grbl.send("~")
    assert grbl.position()[0] == -500
    grbl.lose_sender(waits=True)
    assert grbl.send("") == HELD and grbl.state() == "Hold:0"


@pytest.mark.parametrize("line", ["G4P5\n", "M0\n", "G38.2Z-20F600\n"])
def test_a_line_under_way_is_held(grbl: Grbl, line: str) -> None:
    """A dwell and a probe continue with `~`, as after any hold; a pause stays one, without its spindle."""
    grbl.surface(-2000)
    grbl.fine("M3S500")
    grbl.after(0.3, line)
    grbl.lose_sender()
    said = grbl.after(1)
    assert said == HELD and grbl.state() == "Hold:0" and grbl.outputs().spindle_direction == 0
    assert grbl.send("~").endswith("ok\r\n") and grbl.state() == "Idle" and grbl.outputs().spindle_direction == 1


def test_homing_ends_in_an_alarm_that_says_so(grbl: Grbl) -> None:
    make_homing(grbl)
    grbl.after(0.3, "$H\n")
    grbl.lose_sender()
    assert grbl.send("") == "ALARM:6\r\nok\r\n" + BANNER + LOCKED + "[MSG:Sender lost: homing stopped]\r\n"
    assert grbl.state() == "Alarm" and grbl.position() == grbl.stands()


@pytest.mark.parametrize("stop", ["!", "\x84"])
def test_in_a_hold_the_tools_stop(grbl: Grbl, stop: str) -> None:
    """A hold that the operator made turns the spindle on; now there is no operator."""
    grbl.fine("M3S500")
    grbl.after(0.3, "G1X-30F1000\n")
    grbl.after(1, stop)
    grbl.lose_sender()
    grbl.after(0.1)
    assert grbl.outputs().spindle_direction == 0 and grbl.notice() == NOTICE
    assert grbl.state() == ("Hold:0" if stop == "!" else "Door:0")
    grbl.send("~")
    assert grbl.position()[0] == -7500 and grbl.outputs().spindle_direction == 1 and grbl.notice() is None


def test_in_an_alarm_the_tools_stop(grbl: Grbl) -> None:
    """Alarm 5 leaves the spindle on, as in Grbl, for the operator to look."""
    grbl.fine("M3S500")
    grbl.send("G38.2Z-1F600\n")
    assert grbl.outputs().spindle_direction == 1
    grbl.lose_sender()
    assert grbl.send("") == "" and grbl.state() == "Alarm" and grbl.outputs().spindle_direction == 0
    assert " M5 " in grbl.send("$G\n")


@pytest.mark.parametrize("enter", ["$C\n", "$SLP\n"])
def test_check_mode_and_sleep_stay(grbl: Grbl, enter: str) -> None:
    grbl.send(enter)
    state = grbl.state()
    grbl.lose_sender()
    assert grbl.send("") == "" and grbl.state() == state and grbl.notice() is None


def test_a_hold_that_must_wait_comes_later(grbl: Grbl) -> None:
    """M53 P0 keeps holds away from what must not be interrupted; when that has come to its end, so does it."""
    grbl.fine("M53P0", "M3S500")
    grbl.after(0.3, "G1X-10F1000\n")
    grbl.lose_sender()
    grbl.after(0.05)
    assert grbl.state() == "Run"
    grbl.send("")
    assert grbl.state() == "Hold:0" and grbl.position()[0] == -2500 and grbl.outputs().spindle_direction == 0


def resuming(grbl: Grbl) -> list[int]:
    """A cut is held since its sender is lost, and the next one resumes it: the spindle runs up. Returns where it is."""
    grbl.fine("M3S500")
    grbl.after(0.3, "G1X-30F1000\n")
    grbl.lose_sender()
    grbl.after(1)
    held = grbl.position()
    grbl.after(1, "~")
    assert grbl.outputs().spindle_direction == 1
    return held


def test_resuming_can_be_interrupted(grbl: Grbl) -> None:
    """`!` while the spindle runs up again; then `~` begins again. A reset ends it all."""
    held = resuming(grbl)
    grbl.after(10, "!")
    assert grbl.outputs().spindle_direction == 0 and grbl.position() == held
    grbl.after(1, "~")
    assert grbl.outputs().spindle_direction == 1
    assert grbl.send("\x18").endswith(BANNER) and grbl.state() == "Idle"
    assert grbl.outputs().spindle_direction == 0 and grbl.notice() is None and grbl.position() == held


def test_resuming_at_once(grbl: Grbl) -> None:
    """Someone else is there before it is at rest: nothing was switched off yet."""
    grbl.fine("M3S500")
    grbl.after(0.3, "G1X-30F1000\n")
    grbl.lose_sender()
    grbl.after(0.001)
    assert grbl.state() == "Hold:1"
    grbl.after(0.01, "~")
    assert grbl.state() == "Run" and grbl.outputs().spindle_direction == 1 and grbl.notice() is None
    grbl.send("")
    assert grbl.position()[0] == -7500


def test_the_door_while_resuming(grbl: Grbl) -> None:
    grbl.fine("M3S500")
    grbl.after(0.3, "G1X-30F1000\n")
    grbl.lose_sender()
    grbl.after(1)
    held = grbl.position()
    grbl.after(1, "~")
    grbl.after(10, "\x84")
    assert grbl.state() == "Door:0" and grbl.outputs().spindle_direction == 0 and grbl.position() == held
    grbl.send("~")
    assert grbl.position()[0] == -7500 and grbl.notice() is None


def test_a_laser_is_dark(grbl: Grbl) -> None:
    grbl.fine("$32=1", "M3S500")
    grbl.after(0.3, "G1X-30F1000\n")
    grbl.lose_sender()
    grbl.after(1)
    assert grbl.outputs().spindle_duty == 0 and grbl.state() == "Hold:0"
    grbl.after(0.2, "~")
    assert grbl.outputs().spindle_duty > 0, "it needs no run-up"


@pytest.mark.parametrize("stop", ["!", "\x84"])
def test_its_last_resume_counts_no_more(grbl: Grbl, stop: str) -> None:
    """`~` that the controller has not seen yet when the connection ends: who sent it does not see the machine move."""
    grbl.after(0.3, "G1X-30F1000\n")
    grbl.after(1, stop)
    held = grbl.position()
    grbl.put("~")
    grbl.lose_sender()
    grbl.after(5)
    assert grbl.position() == held and grbl.notice() == NOTICE
    grbl.send("~")
    assert grbl.position()[0] == -7500


def test_while_the_door_restores(grbl: Grbl) -> None:
    """The spindle runs up behind the closed door: it stops again, and the program does not continue."""
    grbl.fine("M3S500")
    grbl.after(0.3, "G1X-30F1000\n")
    grbl.after(1, "\x84")
    held = grbl.position()
    grbl.after(1, "~")
    assert grbl.state() == "Door:3" and grbl.outputs().spindle_direction == 1
    grbl.lose_sender()
    grbl.after(10)
    assert grbl.state() == "Door:0" and grbl.outputs().spindle_direction == 0
    assert grbl.position() == held and grbl.notice() == NOTICE
    grbl.send("~")
    assert grbl.position()[0] == -7500 and grbl.outputs().spindle_direction == 1


def test_in_check_mode_the_tools_stop(grbl: Grbl) -> None:
    """$C leaves the spindle on that was on."""
    grbl.fine("M3S500", "M8")
    grbl.send("$C\n")
    assert grbl.outputs().spindle_direction == 1
    grbl.lose_sender()
    assert grbl.send("") == "" and grbl.state() == "Check"
    assert (grbl.outputs().spindle_direction, grbl.outputs().coolant) == (0, 0)


@pytest.mark.parametrize("line", ["$H\n", "$X\nG1X-5F1000\n"])
def test_in_an_alarm_its_lines_do_not_run(grbl: Grbl, line: str) -> None:
    """What waits would home the machine, or unlock it and move."""
    make_homing(grbl)
    grbl.after(0.3, "$H\n")
    assert grbl.send("\x18").endswith(BANNER + LOCKED) and grbl.state() == "Alarm"
    at = grbl.position()
    grbl.put(line)
    grbl.lose_sender()
    assert grbl.send("") == "[MSG:Sender lost: queued lines discarded]\r\n" + BANNER + LOCKED
    assert grbl.state() == "Alarm" and grbl.position() == at


def test_lost_again_while_the_next_one_resumes(grbl: Grbl) -> None:
    """Whoever resumed is gone before the spindle is up: no one sees the program continue."""
    held = resuming(grbl)
    grbl.lose_sender()
    assert grbl.after(10) == "" and grbl.notice() == NOTICE
    assert grbl.position() == held and grbl.outputs().spindle_direction == 0
    grbl.put("~")
    grbl.lose_sender()
    grbl.after(10)
    assert grbl.position() == held and grbl.state() == "Hold:0"
    grbl.send("~")
    assert grbl.position()[0] == -7500 and grbl.notice() is None


def test_its_last_coolant_toggle_counts_no_more(grbl: Grbl) -> None:
    """0xA0 that the controller has not seen yet."""
    grbl.put("\xa0")
    grbl.lose_sender()
    assert grbl.send("") == "" and grbl.state() == "Idle" and grbl.outputs().coolant == 0


def test_a_hold_while_spindle_and_coolant_return_loses_neither(grbl: Grbl) -> None:
    grbl.fine("M3S1000", "M8")
    grbl.lose_sender()
    grbl.after(0.1)
    assert grbl.outputs().spindle_direction == 0 and grbl.outputs().coolant == 0
    grbl.after(0.1, "~")
    assert grbl.outputs().spindle_direction == 1 and grbl.outputs().coolant == 0  # it runs up first
    grbl.after(0.1, "!")
    assert grbl.outputs().spindle_direction == 0
    grbl.after(10.0, "~")
    assert grbl.outputs().spindle_direction == 1 and grbl.outputs().coolant != 0 and grbl.state() == "Idle"


# what is under way -> settings before, lines, real-time byte then
UNDER_WAY = {
    "run": ((), "M3S500\nM8\nG1X-30F1000\nG1X-60\n", ""),
    "hold": ((), "M3S500\nM8\nG1X-30F1000\n", "!"),
    "door": ((), "M3S500\nM8\nG1X-30F1000\n", "\x84"),
    "M0": ((), "M3S500\nM8\nM0\nG1X-30F1000\n", ""),
    "dwell": ((), "M3S500\nM8\nG4P5\nG1X-30F1000\n", ""),
    "homing": (("$22=1",), "$X\nM3S500\n$H\n", ""),
    "probing": ((), "M3S500\nG38.3Z-20F60\nG1X-30F1000\n", ""),
    "jog": ((), "$J=G91X-100F3000\n" * 5, ""),
    "laser, raster": (("$32=1",), "M4S0\n" + "".join(f"G1X{-x / 10}S{x % 3 * 400}F3000\n" for x in range(80)), ""),
    "laser, cut": (("$32=1",), "M3S800\nG1X-30F1000\nG1X-60\n", ""),
    "idle, tools on": ((), "M3S500\nM8\n", ""),
}


@pytest.mark.parametrize("lost", [0, 1, 2])
@pytest.mark.parametrize("state", UNDER_WAY)
def test_whatever_was_under_way_nothing_is_a_minute_later(grbl: Grbl, state: str, lost: int) -> None:
    """By each choice of $74. 0 finishes what had come, and leaves cutter and coolant as that did; a jog ends by all."""
    settings, lines, byte = UNDER_WAY[state]
    for line in (*settings, f"$74={lost}"):
        grbl.fine(line)
    grbl.after(0.4, lines)
    grbl.after(0.05, byte)
    at = grbl.position()
    grbl.lose_sender()
    grbl.after(1.0)
    if state == "jog":
        assert abs(grbl.position()[0] - at[0]) < 250 * 5, "it did not end"
    if state.startswith("laser") and lost != 0:
        assert grbl.outputs().spindle_duty == 0, "the beam is on"
    grbl.after(59)
    held = grbl.position()
    grbl.after(60)
    assert grbl.position() == held == grbl.stands()
    assert lost == 0 or (grbl.outputs().spindle_direction, grbl.outputs().coolant) == (0, 0)
    assert (lost == 0 and "laser" not in state) or grbl.outputs().spindle_duty == 0
