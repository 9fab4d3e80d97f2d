"""A stop of a jog begins nothing that was sent behind it: no probe, no spindle, no move, no homing.

Lines that wait behind a jog are as locked out as those that are read while it moves; in a parked hold, where they
wait for its end, too.
"""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from grbl_host import Grbl
from hub_hosts import HubHosts
from state_machine import LINES, answers

SENDER, OBSERVER, PENDANT = range(3)
LOCKED, NOT_IDLE = "error:9", "error:8"
JOG = "$J=G91Y3F900\n"  # 0.2 s
BEHIND = ["G91G1X5F600", "G38.2Z-2F100", "M3S500", "M8", "$H", "G10L20P1Y0"]
STOPS = ["!", "\x85"]


@pytest.fixture
def hub() -> Iterator[HubHosts]:
    made = HubHosts(pendants=(PENDANT,))
    made.heard()
    made.fine(*LINES)
    for place in (OBSERVER, PENDANT):
        made.put_of(place, "?")
    made.after(0.1)
    yield made
    made.close()


def rests(hub: HubHosts, seconds: float) -> None:
    """Nothing moves, nothing is switched on."""
    before = hub.stands()
    hub.passes(seconds)
    outputs = hub.outputs()
    assert hub.stands() == before
    assert (outputs.spindle_direction, outputs.coolant) == (0, 0)


@pytest.mark.parametrize("jogs", [20, 30])
@pytest.mark.parametrize("stop", STOPS)
@pytest.mark.parametrize("line", BEHIND)
def test_what_waits_behind_jogs_in_the_controller(line: str, stop: str, jogs: int) -> None:
    """More jogs than it plans, so the line is not read before the stop."""
    grbl = Grbl()
    grbl.send("")
    grbl.fine(*LINES)
    said = grbl.after(0.3, JOG * jogs + line + "\n")
    assert grbl.state() == "Jog"
    said += grbl.after(0.2, stop)
    before = grbl.stands()
    said += grbl.after(1.5)
    outputs = grbl.outputs()
    assert grbl.stands() == before
    assert (outputs.spindle_direction, outputs.coolant) == (0, 0)
    assert answers(said)[:-1] == ["ok"] * jogs
    assert answers(said)[-1] in (LOCKED, NOT_IDLE)
    assert grbl.after(0.5, "G91G1Y1F600\n") == "ok\r\n"
    grbl.close()


@pytest.mark.parametrize("who", [SENDER, OBSERVER, PENDANT])
@pytest.mark.parametrize("stop", STOPS)
@pytest.mark.parametrize("line", [line for line in BEHIND if line[0] != "$"])
def test_what_waits_behind_a_jog_in_a_parked_hold(hub: HubHosts, line: str, stop: str, who: int) -> None:
    hub.after(0.3, "!")
    hub.after(0.5, "\xa3")
    hub.put_of(SENDER, "$J=G91Y30F900\n" + line + "\n")
    hub.passes(0.3)
    hub.put_of(who, stop)
    hub.passes(0.2)
    rests(hub, 1.5)
    assert answers(hub.heard_of(SENDER)) == ["ok", LOCKED]


def test_the_job_behind_a_parked_hold_is_not_refused(hub: HubHosts) -> None:
    hub.put_of(SENDER, "G91G1X10F600\nG1X1\nG1X1\n")
    hub.after(0.3, "!")
    hub.after(0.5, "\xa3$J=G91Y3F900\n")
    hub.after(0.5, "!")
    assert set(answers(hub.after(9, "~"))) <= {"ok"}
    assert hub.position()[0] == 120


@pytest.mark.parametrize("who", [SENDER, OBSERVER, PENDANT])
@pytest.mark.parametrize("stop", STOPS)
@pytest.mark.parametrize("jogs", [20, 40, 60])
def test_what_waits_behind_jogs_in_the_server(hub: HubHosts, jogs: int, stop: str, who: int) -> None:
    """More than the controller takes: the rest waits in the server, and a stop does not begin it either."""
    hub.put_of(SENDER, JOG * jogs + "M8\nM3S500\n$G\nG1X5F600\n")
    hub.passes(0.3)
    assert hub.waits_of(SENDER) > 0 or jogs == 20
    hub.put_of(who, stop)
    hub.passes(0.2)
    rests(hub, 3)
    said = answers(hub.heard_of(SENDER))
    assert said == ["ok"] * jogs + [LOCKED, LOCKED, "ok", LOCKED]
    assert hub.after(0.6) == ""
    assert answers(hub.after(0.5, "G91G1Y1F600\n")) == ["ok"], "what is sent behind the stop is new"


@pytest.mark.parametrize("jogs", [0, 1])
def test_a_job_that_waits_in_the_server_is_not_refused(hub: HubHosts, jogs: int) -> None:
    """A hold of a job, also where the sender has jogged before."""
    hub.after(1, JOG * jogs)
    hub.put_of(SENDER, "G91\n" + "G1X0.5F600\n" * 150)
    hub.passes(0.3)
    assert hub.waits_of(SENDER) > 0
    hub.put_of(OBSERVER, "!")
    hub.passes(0.5)
    hub.put_of(SENDER, "~")
    hub.passes(15)
    assert answers(hub.heard_of(SENDER)) == ["ok"] * 151


@pytest.mark.parametrize("who", [SENDER, OBSERVER, PENDANT])
@pytest.mark.parametrize("stop", STOPS)
@pytest.mark.parametrize("jogs", [5, 20, 40])
def test_what_waits_behind_a_pendants_jogs(hub: HubHosts, jogs: int, stop: str, who: int) -> None:
    hub.put_of(PENDANT, JOG * jogs + "M8\nM3S500\n$G\nG1X5F600\n")
    hub.passes(0.3)
    hub.put_of(who, stop)
    hub.passes(0.2)
    rests(hub, 3)
    said = answers(hub.heard_of(PENDANT))
    assert said == ["ok"] * jogs + [LOCKED, LOCKED, "ok", LOCKED]
    hub.put_of(PENDANT, "G91G1Y1F600\n")
    hub.passes(0.5)
    assert answers(hub.heard_of(PENDANT)) == ["ok"], "what is sent behind the stop is new"


@pytest.mark.parametrize("operator", [SENDER, PENDANT])
@pytest.mark.parametrize("who", [SENDER, OBSERVER, PENDANT])
@pytest.mark.parametrize("stop", STOPS)
@pytest.mark.parametrize("jogs", [5, 20])
def test_what_waits_in_the_server_in_a_parked_hold(
    hub: HubHosts, jogs: int, stop: str, who: int, operator: int
) -> None:
    """Of the operator's lines the controller takes a few only."""
    hub.after(0.3, "!")
    hub.after(0.5, "\xa3")
    hub.put_of(operator, JOG * jogs + "M8\nM3S500\nG1X5F600\n")
    hub.passes(0.3)
    hub.put_of(who, stop)
    hub.passes(0.2)
    rests(hub, 6)
    said = answers(hub.heard_of(operator))
    assert said[:jogs] == ["ok"] * jogs and "ok" not in said[jogs:] and len(said) == jogs + 3
