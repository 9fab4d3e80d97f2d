"""A parked hold behind the network's server, where lines of a job wait: those of the operator, the
client in control, pass them, are answered first and to their sender, and never run within the job."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from hub_hosts import HubHosts
from state_machine import LINES, answers
from test_switches import make_homing

AHEAD = 8  # lines of the job that wait in the hold, more than the server gives to the controller
REST_S, RETURN_S = 0.5, 20.0
JOG, JOGGED = "$J=G91Y3F1200\n", [50, 30, 0]


@pytest.fixture
def hub() -> Iterator[HubHosts]:
    """With as little room as on a chip; 10 steps/mm."""
    made = HubHosts()
    made.heard()
    made.fine("$747=1", *LINES)
    for place in (1, 2):
        made.put_of(place, "?")  # who says nothing is disconnected
    made.after(0.1)
    yield made
    made.close()


def hold_job(hub: HubHosts, ahead: int = AHEAD) -> None:
    assert answers(hub.after(2, "G91G1X5F600\nM0\n" + "G1X5\n" * ahead)) == ["ok"]
    assert hub.state() == "Hold:0"
    for place in range(3):
        hub.heard_of(place)


def operate(hub: HubHosts, place: int, lines: str, seconds: float = REST_S) -> list[str]:
    """What the client is answered."""
    hub.heard_of(place)  # what others were answered before
    hub.put_of(place, lines)
    if place == 0:
        return answers(hub.after(seconds))
    hub.after(seconds)
    return answers(hub.heard_of(place))


def finish(hub: HubHosts, place: int, ahead: int = AHEAD) -> list[str]:
    said = operate(hub, place, "~", RETURN_S)
    assert hub.state() == "Idle" and hub.position()[:3] == [50 * (1 + ahead), 0, 0]
    return said


@pytest.mark.parametrize("ahead", [0, 1, AHEAD, 200])
def test_lines_of_the_operator_pass_those_of_its_own_job(hub: HubHosts, ahead: int) -> None:
    hold_job(hub, ahead)
    assert operate(hub, 0, "\xa3" + JOG) == ["ok"] and hub.position()[:3] == JOGGED
    assert operate(hub, 0, "G10L20P2X1\n$TRUST\n$G\n") == ["ok"] * 3
    assert len(answers(hub.after(7 + ahead, "~"))) == 1 + ahead
    assert hub.position()[:3] == [50 * (1 + ahead), 0, 0]


@pytest.mark.parametrize("ahead", [0, AHEAD])
def test_who_takes_control_in_a_pause_is_the_operator(hub: HubHosts, ahead: int) -> None:
    """The job's line that is under way is answered when it has run, and not by what the operator does."""
    hold_job(hub, ahead)
    hub.put_of(1, "$TAKE\n\xa3")
    assert answers(hub.after(REST_S)) == [] and answers(hub.heard_of(1)) == ["ok"]
    assert operate(hub, 1, JOG) == ["ok"] and hub.position()[:3] == JOGGED
    assert operate(hub, 1, "$J=G91Y-1F1200\n") == ["ok"]
    assert operate(hub, 1, "G91G38.2Z-1F300\n") == ["error:171"]
    assert finish(hub, 1, 0) == [], "nothing of the job but its M0"


def test_who_takes_control_of_a_parked_hold_goes_on_with_it(hub: HubHosts) -> None:
    hold_job(hub)
    assert operate(hub, 0, "\xa3" + JOG) == ["ok"]
    assert operate(hub, 1, "$TAKE\n" + JOG) == ["ok", "ok"] and hub.position()[:3] == [50, 60, 0]
    hub.heard_of(0)
    assert finish(hub, 1, 0) == []
    assert operate(hub, 0, "$TAKE\n")[-1:] == ["ok"]


def test_a_jog_of_who_loses_control_is_answered_to_it(hub: HubHosts) -> None:
    hold_job(hub)
    assert operate(hub, 0, "\xa3", 0.1) == []
    hub.put_of(0, "G91G38.3Y9F60\n$G\n")
    hub.after(0.5)
    assert operate(hub, 1, "$TAKE\n") == ["ok"], "the cancel is before it"
    assert operate(hub, 1, JOG) == ["ok"]


def test_a_job_of_a_lost_sender_waits_behind_the_operator(hub: HubHosts) -> None:
    hub.after(1, "G91G1X100F600\n" + "G1X5\n" * 60)
    hub.lose_client(0)
    hub.after(8)
    assert hub.state() == "Hold:0"
    left = hub.position()[:3]
    assert operate(hub, 1, "\xa3") == []
    assert operate(hub, 1, JOG) == ["ok"] and hub.position()[:3] == [left[0], 30, 0]
    operate(hub, 1, "~", 60)
    assert hub.position()[:3] == [1000 + 60 * 50, 0, 0]


def test_a_resume_waits_for_the_lines_before_it(hub: HubHosts) -> None:
    """In one piece, and then lines of the job."""
    hold_job(hub)
    assert operate(hub, 0, f"\xa3{JOG}G10L20P2Y7\n{JOG}~G1X5\n", RETURN_S) == ["ok"] * (3 + 1 + AHEAD + 1)
    assert hub.position()[:3] == [50 * (2 + AHEAD), 0, 0]
    assert "[G55:0.000,-4.000,0.000]" in hub.after(0.1, "$#\n"), "behind one jog"


@pytest.mark.parametrize("stop", ["!", "\x85", "\x84", "the button"])
def test_no_resume_outlives_a_stop(hub: HubHosts, stop: str) -> None:
    hold_job(hub)
    assert operate(hub, 0, "\xa3", 0.1) == []
    hub.put_of(0, "G91G38.3Y90F600\nG10L20P1Y0\n~")
    hub.after(0.2)
    if stop == "the button":
        hub.input("hold", True)
        hub.after(0.05)
        hub.input("hold", False)
    else:
        hub.put_of(0, stop)
    hub.after(RETURN_S)
    assert hub.state() in ("Hold:0", "Door:0") and 50 < hub.position()[1] + 50 < 900


def test_lines_that_were_not_read_do_not_run_within_the_job(hub: HubHosts) -> None:
    """The start button is pressed while they wait for the operator's own motion."""
    hold_job(hub)
    assert operate(hub, 0, "\xa3", 0.1) == []
    hub.put_of(0, "G91G38.3Y9F600\nG10L20P1X99\nG10L20P1X98\n")
    hub.after(0.2)
    hub.input("start", True)
    said = answers(hub.after(RETURN_S))
    assert said == ["ok", "error:170", "error:170", *["ok"] * (1 + AHEAD)]
    assert hub.position()[:3] == [50 * (1 + AHEAD), 0, 0]
    assert "[G54:0.000,0.000,0.000]" in hub.after(0.1, "$#\n")


def leave_half_a_line(hub: HubHosts) -> None:
    """The start button is pressed in the middle of a line of the operator."""
    hold_job(hub)
    assert operate(hub, 0, "\xa3G10L20P1X9", 0.1) == []
    hub.input("start", True)
    assert answers(hub.after(RETURN_S)) == ["ok"] * (1 + AHEAD)


def test_half_a_line_of_the_operator_is_refused_at_its_end(hub: HubHosts) -> None:
    """As a line of the job it would set work zero in mid-cut. An answer that comes before the line has ended is
    missing behind it: a sender that waits for each answer would wait for ever."""
    leave_half_a_line(hub)
    assert answers(hub.after(1, "9\n")) == ["error:170"]
    assert "[G54:0.000,0.000,0.000]" in hub.after(0.1, "$#\n")


def test_half_a_line_of_who_loses_control_is_answered_once(hub: HubHosts) -> None:
    leave_half_a_line(hub)
    assert operate(hub, 1, "$TAKE\n") == ["ok"]
    assert answers(hub.after(0.1, "9\n")) == ["error:181"]


@pytest.mark.parametrize("half", [False, True])
def test_what_follows_a_reset_of_its_own_is_a_new_line(hub: HubHosts, half: bool) -> None:
    if half:
        leave_half_a_line(hub)
    assert "Grbl 1.1h" in hub.after(1, "\x18")
    assert answers(hub.after(0.1, "$G\n")) == ["ok"]


def test_a_refused_park_leaves_lines_to_the_job(hub: HubHosts) -> None:
    assert answers(hub.after(0.1, "G91G1X10F600\n\xa3G1X5\n")) == ["ok", "ok"]
    hub.after(3)
    assert hub.position()[:3] == [150, 0, 0]


def test_half_a_line_of_the_job_is_continued_behind_the_hold(hub: HubHosts) -> None:
    hold_job(hub, 1)
    assert operate(hub, 0, "G1X\xa3" + JOG) == ["ok"]
    assert operate(hub, 0, "~7\n", RETURN_S) == ["ok"] * 3
    assert hub.position()[:3] == [50 + 50 + 70, 0, 0]


def test_a_reset_forgets_both(hub: HubHosts) -> None:
    hold_job(hub)
    hub.put_of(0, f"\xa3{JOG}{JOG}~")
    assert "Grbl 1.1h" in hub.after(1, "\x18")
    assert answers(hub.after(1, "$X\nG91G1X1F600\n")) == ["ok", "ok"]


def wait_for_tool(hub: HubHosts) -> None:
    make_homing(hub)
    hub.fine("$100=250", "$101=250", "$102=250", "$341=1")
    assert answers(hub.after(60, "$H\n")) == ["ok"]
    hub.after(5, "G53G0X-10Y-10Z-10\n")
    assert answers(hub.after(3, "T1M6\n")) == [] and hub.state() == "Tool"
    hub.heard_of(1)


def test_who_takes_control_in_a_tool_change_answers_no_line_of_the_job(hub: HubHosts) -> None:
    """Its lines wait: without 0xA3 they would be taken for lines behind M6."""
    wait_for_tool(hub)
    hub.put_of(1, "$TAKE\n$G\n")
    assert answers(hub.after(REST_S)) == [] and answers(hub.heard_of(1)) == ["ok"]
    assert operate(hub, 1, "\xa3$J=G91X1F600\n") == ["ok"]
    assert operate(hub, 1, "~", RETURN_S) == ["ok"] and hub.state() == "Idle"


def test_who_had_control_in_a_tool_change_measures_nothing_behind_it(hub: HubHosts) -> None:
    wait_for_tool(hub)
    at = hub.position()
    hub.put_of(1, "$TAKE\n$TPW\n")
    hub.put_of(2, "$TAKE\n")
    assert answers(hub.after(3)) == [] and hub.position() == at
    assert answers(hub.heard_of(1)) == answers(hub.heard_of(2))[-1:] == ["ok"]
    assert operate(hub, 2, "~", RETURN_S) == [] and hub.state() == "Idle"
    assert answers(hub.heard_of(1))[-1:] == ["error:181"]
