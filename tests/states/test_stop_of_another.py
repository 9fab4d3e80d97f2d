"""A stop while a pendant or a remote host jogs and lines of the sender wait: it begins neither motion nor an output."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import closing

import pytest
from generate.states_table import load_states
from hub_hosts import HubHosts
from state_machine import LINES, answers

TABLE = load_states()
SENDER, OBSERVER, PENDANT = range(3)
JOG = "$J=G91Y100F600\n"
JOB = "M3S500\nG91G1X50F600\n"
HELD = "[MSG:Stopped: the sender's lines wait for ~]"
RUN_S = 8.0  # longer than the job takes


@pytest.fixture
def hub(request: pytest.FixtureRequest) -> Iterator[HubHosts]:
    """10 steps/mm; the sender is idle, the pendant or the host jogs, and the sender has started a job."""
    made = HubHosts(pendants=(PENDANT,))
    made.heard()
    made.fine(*LINES, "$22=0")
    for place in (OBSERVER, PENDANT):
        made.put_of(place, "?")
    made.after(0.1)
    if getattr(request, "param", "pendant") == "remote host":
        made.packet(TABLE.inputs["host_jog"])
    else:
        made.put_of(PENDANT, JOG)
    made.after(1)
    yield made
    made.close()


def button(hub: HubHosts) -> None:
    hub.input("hold", True)
    hub.passes(0.05)
    hub.input("hold", False)


STOPS: dict[str, Callable[[HubHosts], None]] = {
    "pendant's !": lambda hub: hub.put_of(PENDANT, "!"),
    "pendant's 0x85": lambda hub: hub.put_of(PENDANT, "\x85"),
    "sender's !": lambda hub: hub.put_of(SENDER, "!"),
    "sender's 0x85": lambda hub: hub.put_of(SENDER, "\x85"),
    "observer's !": lambda hub: hub.put_of(OBSERVER, "!"),
    "button": button,
}


@pytest.mark.parametrize("hub", ["pendant", "remote host"], indirect=True)
@pytest.mark.parametrize("stop", STOPS)
def test_lines_that_wait_do_not_begin_by_a_stop(hub: HubHosts, stop: str) -> None:
    hub.put_of(SENDER, JOB)
    hub.after(0.2)
    STOPS[stop](hub)
    said = hub.after(RUN_S)
    assert HELD in said and answers(said) == [], "of the job"
    rested = hub.position()[0]
    assert rested == hub.stands()[0] and hub.outputs().spindle_direction == 0
    assert answers(hub.after(RUN_S, "~")) == ["ok", "ok"]
    assert hub.position()[0] == rested + 500 and hub.outputs().spindle_direction == 1


@pytest.mark.parametrize("stop", ["host_hold", "other_host_hold"])
@pytest.mark.parametrize("hub", ["remote host"], indirect=True)
def test_a_hold_of_a_host_is_such_a_stop(hub: HubHosts, stop: str) -> None:
    hub.put_of(SENDER, JOB)
    hub.after(0.2)
    hub.packet(TABLE.inputs[stop])
    said = hub.after(RUN_S)
    assert HELD in said and answers(said) == [] and hub.outputs().spindle_direction == 0


@pytest.mark.parametrize("pause_s", [0.5, RUN_S])
@pytest.mark.parametrize("hub", ["remote host"], indirect=True)
def test_a_released_key_lets_them_begin_also_after_a_stop_before(hub: HubHosts, pause_s: float) -> None:
    """A stop counts for the jog that it has ended, whether or not the host has given motion back since."""
    hub.put_of(OBSERVER, "!")
    hub.after(pause_s)
    hub.packet(TABLE.inputs["host_jog"])
    hub.after(0.5)
    hub.put_of(SENDER, JOB)
    hub.packet(TABLE.inputs["host_jog_stop"])
    assert answers(hub.after(RUN_S + 2)) == ["ok", "ok"] and hub.outputs().spindle_direction == 1


@pytest.mark.parametrize("stop", STOPS)
def test_without_lines_that_wait_a_stop_ends_the_jog_alone(hub: HubHosts, stop: str) -> None:
    STOPS[stop](hub)
    assert HELD not in hub.after(1) and hub.state() == "Idle"
    assert answers(hub.after(RUN_S, JOB)) == ["ok", "ok"] and hub.position()[0] == 500


def test_a_jog_that_ends_by_itself_lets_them_begin(hub: HubHosts) -> None:
    assert answers(hub.after(10 + RUN_S, JOB)) == ["ok", "ok"] and hub.position()[:2] == [500, 1000]


def test_the_beam_is_dark_in_the_round_in_which_a_reset_comes() -> None:
    """The server lets the controller act within it, and no step follows with which the beam could go off."""
    with closing(HubHosts()) as hub:
        hub.heard()
        hub.fine(*LINES, "$32=1")
        hub.after(1, "M3S500\nG91G1X50F300\n")
        assert hub.outputs().spindle_duty > 0
        hub.put("\x18")
        assert hub.outputs().spindle_duty == 0
