"""A stop by someone else while a key is held: the jogs that the key still sends do not move the machine.

A held key of `$J=` sends one jog behind the other, a WMC3 host repeats its jog every 150 ms (docs/protocol.md). Both
end by a stop of another client, host or button, and stay ended until the key was released for 0.5 s.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import pytest
from c_library import LIB
from generate.states_table import load_states
from grbl_host import HZ
from hub_hosts import HubHosts
from state_machine import LINES, answers

TABLE = load_states()
SENDER, OBSERVER, PENDANT = range(3)
JOG = "$J=G91X2F600\n"  # 0.2 s each
EACH_S = 0.15
STOPPED = "error:184"
TOLD = "[MSG:Another client or a button stopped the jog: release the key]"
RELEASED_S = 0.6


@pytest.fixture
def hub() -> Iterator[HubHosts]:
    made = HubHosts(pendants=(PENDANT,))
    made.heard()
    made.fine(*LINES, "$22=0")
    for place in (OBSERVER, PENDANT):
        made.put_of(place, "?")
    made.after(0.1)
    yield made
    made.close()


def button(name: str) -> Callable[[HubHosts], None]:
    def presses(hub: HubHosts) -> None:
        hub.input(name, True)
        hub.passes(0.05)
        hub.input(name, False)

    return presses


def byte(place: int, sent: str) -> Callable[[HubHosts], None]:
    return lambda hub: hub.put_of(place, sent)


BUTTON = {"hold button": button("hold")}
OTHERS = {
    "sender": {"!": byte(SENDER, "!"), "0x85": byte(SENDER, "\x85")},
    "observer": {"!": byte(OBSERVER, "!"), "0x85": byte(OBSERVER, "\x85")},
    "pendant": {"!": byte(PENDANT, "!"), "0x85": byte(PENDANT, "\x85")},
}
PLACES = {"sender": SENDER, "pendant": PENDANT}


def stops_of(but: str) -> dict[str, Callable[[HubHosts], None]]:
    named = {f"{who}'s {what}": act for who, acts in OTHERS.items() if who != but for what, act in acts.items()}
    return named | BUTTON


def holds_key(hub: HubHosts, place: int, seconds: float) -> str:
    """Sends jogs as a held key does. @return what it hears"""
    said = ""
    for _ in range(round(seconds / EACH_S)):
        hub.put_of(place, JOG)
        hub.passes(EACH_S)
        said += hub.heard_of(place)
    return said


@pytest.mark.parametrize(
    ("who", "stop"), [(who, stop) for who in PLACES for stop in stops_of(who)], ids=lambda value: str(value)
)
def test_what_a_held_key_sends_behind_the_stop_of_another_does_not_move(hub: HubHosts, who: str, stop: str) -> None:
    place = PLACES[who]
    holds_key(hub, place, 1.5)
    assert hub.position()[0] > 0
    stops_of(who)[stop](hub)
    hub.passes(0.4)
    told = hub.heard_of(place).count(TOLD)
    rested = hub.position()[0]
    said = holds_key(hub, place, 4)
    assert hub.position()[0] == rested
    assert set(answers(said)) == {STOPPED}
    assert told + said.count(TOLD) == 1
    hub.passes(RELEASED_S)
    hub.heard_of(place)
    assert set(answers(holds_key(hub, place, 1))) == {"ok"}, "pressed again"
    hub.passes(1)
    assert hub.position()[0] > rested


@pytest.mark.parametrize("who", PLACES)
@pytest.mark.parametrize("stop", ["!", "\x85"])
def test_who_ends_its_own_jog_may_jog_immediately(hub: HubHosts, who: str, stop: str) -> None:
    """As in Grbl: a released key, and the next one pressed."""
    place = PLACES[who]
    holds_key(hub, place, 1)
    hub.put_of(place, stop)
    hub.passes(0.1)
    hub.heard_of(place)
    before = hub.position()[0]
    said = holds_key(hub, place, 0.3)
    hub.passes(1)
    assert set(answers(said + hub.heard_of(place))) == {"ok"}
    assert hub.position()[0] > before


@pytest.mark.parametrize("stop", stops_of("sender"))
def test_a_stop_at_rest_in_a_parked_hold_is_reported(hub: HubHosts, stop: str) -> None:
    """Between two steps of a probing cycle: the state stays Hold, so that nothing else tells its client."""
    hub.put_of(SENDER, "G91G1Z20F600\n")
    hub.after(0.5)
    hub.after(0.5, "!")
    hub.after(0.5, "\xa3")
    hub.passes(2 * RELEASED_S)
    assert TOLD not in hub.heard_of(SENDER)
    stops_of("sender")[stop](hub)
    hub.passes(0.1)
    assert hub.heard_of(SENDER).count(TOLD) == 1


@pytest.mark.parametrize("stop", stops_of("sender"))
def test_also_in_a_parked_hold(hub: HubHosts, stop: str) -> None:
    hub.put_of(SENDER, "G91G1Z20F600\n")
    hub.after(0.5)
    hub.after(0.5, "!")
    hub.after(0.5, "\xa3")
    holds_key(hub, SENDER, 1.5)
    stops_of("sender")[stop](hub)
    hub.passes(0.4)
    hub.heard_of(SENDER)
    rested = hub.position()[0]
    assert rested > 0
    assert set(answers(holds_key(hub, SENDER, 2))) == {STOPPED}
    assert hub.position()[0] == rested


STEPS = [(who, stop, "idle") for who in PLACES for stop in stops_of(who)]
STEPS += [("sender", stop, "parked") for stop in stops_of("sender")]


@pytest.mark.parametrize(("who", "stop", "where"), STEPS, ids=lambda value: str(value))
def test_who_jogs_one_step_is_told_of_the_stop(hub: HubHosts, who: str, stop: str, where: str) -> None:
    """It sends nothing after the step, so no refusal tells that the machine rests elsewhere."""
    place = PLACES[who]
    if where == "parked":
        hub.put_of(SENDER, "G91G1Z20F600\n")
        hub.after(0.5)
        hub.after(0.5, "!")
        hub.after(0.5, "\xa3")
    hub.put_of(place, "$J=G91X40F600\n")
    hub.passes(0.5)
    hub.heard_of(place)
    stops_of(who)[stop](hub)
    hub.passes(1)
    rested = hub.position()[0]
    assert hub.heard_of(place).count(TOLD) == 1
    hub.passes(1)
    assert hub.position()[0] == rested > 0


@pytest.mark.parametrize("stop", ["!", "\x85"])
def test_a_step_that_has_ended_is_not_said_to_be_stopped(hub: HubHosts, stop: str) -> None:
    hub.put_of(SENDER, JOG)
    hub.passes(0.4)
    hub.put_of(OBSERVER, stop)
    hub.passes(1)
    assert TOLD not in hub.heard_of(SENDER)


def test_a_stop_that_ends_no_jog_refuses_none(hub: HubHosts) -> None:
    """A job was held and continues; then its operator jogs."""
    hub.put_of(SENDER, "G91G1X1F600\n")
    hub.put_of(OBSERVER, "!")
    hub.after(1)
    hub.after(1, "~")
    said = holds_key(hub, SENDER, 0.3)
    hub.passes(1)
    assert set(answers(said + hub.heard_of(SENDER))) == {"ok"}


STEP = "$J=G91X0.5F600\n"  # 50 ms


@pytest.mark.parametrize("who", PLACES)
@pytest.mark.parametrize("stop", ["!", "\x85"])
def test_a_key_up_behind_a_jog_that_has_ended_refuses_no_other_tap(hub: HubHosts, who: str, stop: str) -> None:
    """Pendants send a jog cancel when a key is released, also of a jog that has long arrived."""
    place = PLACES[who]
    for _ in range(4):
        hub.put_of(place, STEP)
        hub.passes(0.2)
        hub.put_of(place, stop)
        hub.passes(0.1)
        hub.put_of(place, "~")
        hub.passes(0.05)
    assert set(answers(hub.heard_of(place))) == {"ok"}
    hub.passes(1)
    assert hub.position()[0] == 4 * 5


CLOCK_S = 2**32 / 1e6  # hal_time_us() begins again


@pytest.mark.parametrize("before_s", [2.3, 1.4])
def test_a_stopped_key_stays_stopped_when_the_clock_begins_again(hub: HubHosts, before_s: float) -> None:
    LIB.host_run_until(hub._host, round((CLOCK_S - before_s) * HZ))
    hub.after(0.1)
    holds_key(hub, SENDER, 1.2)
    hub.put_of(PENDANT, "!")
    hub.passes(0.3)
    hub.heard_of(SENDER)
    rested = hub.position()[0]
    assert rested > 0
    assert set(answers(holds_key(hub, SENDER, 3))) == {STOPPED}
    assert hub.position()[0] == rested


def repeats(hub: HubHosts, seconds: float) -> None:
    for _ in range(round(seconds / EACH_S)):
        hub.packet(TABLE.inputs["host_jog"])
        hub.passes(EACH_S)


@pytest.mark.parametrize("stop", ["sender's !", "observer's 0x85", "pendant's !", "hold button", "host_hold"])
def test_a_jog_that_a_host_repeats_ends_and_stays_ended(hub: HubHosts, stop: str) -> None:
    repeats(hub, 1.5)
    started = hub.stands()
    if stop == "host_hold":
        hub.packet(TABLE.inputs[stop])
    else:
        stops_of("host")[stop](hub)
    hub.passes(0.4)
    rested = hub.stands()
    assert started != [0] * len(started)
    repeats(hub, 3)
    assert hub.stands() == rested
    hub.passes(RELEASED_S)
    repeats(hub, 1)
    assert hub.stands() != rested
