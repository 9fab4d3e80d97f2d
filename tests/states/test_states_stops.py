"""A stop never begins motion, whatever is kept and whose line is under way: a `~` from before it counts no more, and a
`~` from after it always leads on. Several clients, of whom one or two are pendants, behind the network's server."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import pytest
from hub_hosts import HubHosts
from state_machine import LINES, answers

OWNER, PENDANT, SECOND = range(3)
JOG, JOGGED = "$J=G91Y3F1200\n", 30  # 10 steps/mm
REST_S, RETURN_S = 0.5, 10.0

# A line of the pendant that a hold keeps, and whether it is answered before it is done.
UNDER_WAY = {
    "a tool change": ("T1M6\n", "", False),
    "a pause": ("M0\n", "", False),
    "a dwell": ("G4P30\n", "!", False),
    "a move": ("G91G1X50F600\n", "!", True),
}
STOPS: dict[str, Callable[[HubHosts], None]] = {
    "hold": lambda hub: hub.put("!"),
    "jog cancel": lambda hub: hub.put("\x85"),
    "door byte": lambda hub: hub.put("\x84"),
    "reset": lambda hub: hub.put("\x18"),
    "hold button": lambda hub: press(hub, "hold"),
    "door": lambda hub: press(hub, "door"),
    "e-stop": lambda hub: press(hub, "estop"),
    "sender lost": lambda hub: hub.lose_client(OWNER),
    "taken": lambda hub: hub.put_of(SECOND, "$TAKE\n"),
    "another's hold": lambda hub: hub.put_of(SECOND, "!"),
    "pendant's jog cancel": lambda hub: hub.put_of(PENDANT, "\x85"),
}


def press(hub: HubHosts, pin: str) -> None:
    hub.input(pin, True)
    hub.passes(0.05)
    hub.input(pin, False)


def made(pendants: tuple[int, ...]) -> Iterator[HubHosts]:
    hub = HubHosts(pendants=pendants)
    hub.heard()
    hub.fine("$747=1", *LINES, "G4P0")
    for place in (PENDANT, SECOND):
        hub.put_of(place, "?")  # who says nothing is disconnected
    hub.after(0.1)
    yield hub
    hub.close()


@pytest.fixture
def hub() -> Iterator[HubHosts]:
    yield from made((PENDANT,))


@pytest.fixture
def pendants() -> Iterator[HubHosts]:
    yield from made((PENDANT, SECOND))


def put(hub: HubHosts, place: int, data: str, seconds: float = REST_S) -> None:
    hub.put_of(place, data)
    hub.passes(seconds)


def heard(hub: HubHosts, place: int) -> list[str]:
    return answers(hub.heard_of(place))


def hold_pendants(hub: HubHosts, name: str) -> None:
    line, stop, answered = UNDER_WAY[name]
    put(hub, PENDANT, line, 1)
    put(hub, OWNER, stop, 1)
    assert hub.state() == "Hold:0"
    assert heard(hub, PENDANT) == ["ok"] * answered and heard(hub, OWNER) == []


@pytest.mark.parametrize("name", UNDER_WAY)
def test_the_owner_operates_while_a_pendants_line_is_held(hub: HubHosts, name: str) -> None:
    hold_pendants(hub, name)
    put(hub, OWNER, "\xa3" + JOG)
    assert heard(hub, OWNER) == ["ok"] and hub.position()[1] == JOGGED
    put(hub, OWNER, JOG + "~", RETURN_S + 32)
    assert heard(hub, OWNER) == ["ok"] and hub.state() == "Idle"
    assert heard(hub, PENDANT) == ["ok"] * (not UNDER_WAY[name][2])
    put(hub, OWNER, "G4P0\n")
    assert heard(hub, OWNER) == ["ok"] and heard(hub, PENDANT) == []
    put(hub, PENDANT, JOG)
    assert heard(hub, PENDANT) == ["ok"] and heard(hub, OWNER) == []


@pytest.mark.parametrize("name", UNDER_WAY)
def test_another_pendant_operates_while_ones_line_is_held(pendants: HubHosts, name: str) -> None:
    hold_pendants(pendants, name)
    put(pendants, SECOND, "\xa3" + JOG)
    put(pendants, PENDANT, JOG)
    put(pendants, OWNER, JOG)
    assert pendants.position()[1] == 3 * JOGGED
    assert [heard(pendants, place) for place in range(3)] == [["ok"]] * 3
    put(pendants, PENDANT, "~", RETURN_S + 32)
    assert pendants.state() == "Idle"
    assert heard(pendants, PENDANT) == ["ok"] * (not UNDER_WAY[name][2])
    assert heard(pendants, OWNER) == heard(pendants, SECOND) == []


@pytest.mark.parametrize("resume", ["owner", "pendant", "start button"])
@pytest.mark.parametrize("name", UNDER_WAY)
def test_every_resume_leads_on(hub: HubHosts, name: str, resume: str) -> None:
    """In the same packet as the operator's line, or by who has not sent it."""
    hold_pendants(hub, name)
    put(hub, OWNER, "\xa3" + JOG + ("~" if resume == "owner" else ""), 0.1)
    if resume == "pendant":
        hub.put_of(PENDANT, "~")
    elif resume == "start button":
        press(hub, "start")
    put(hub, OWNER, "", RETURN_S + 32)
    assert hub.state() == "Idle" and heard(hub, OWNER) == ["ok"]


def test_a_pendant_in_control_refuses_lines_of_the_operator_and_resumes(hub: HubHosts) -> None:
    """0x8B: what is refused of the owner is not waited for."""
    put(hub, PENDANT, "\x8bT1M6\n", 1)
    put(hub, OWNER, "\xa3" + JOG + "~", RETURN_S)
    assert heard(hub, OWNER) == ["error:183"] and hub.state() == "Idle"
    assert heard(hub, PENDANT) == ["ok"]


def test_who_takes_control_from_a_pendant_operates_in_its_tool_change(hub: HubHosts) -> None:
    put(hub, PENDANT, "\x8bT1M6\n", 1)
    put(hub, PENDANT, "\xa3" + JOG)
    assert heard(hub, PENDANT) == ["ok"] and hub.position()[1] == JOGGED
    put(hub, OWNER, "$TAKE\n" + JOG)
    assert heard(hub, OWNER) == ["ok"] * 2 and hub.position()[1] == 2 * JOGGED
    put(hub, OWNER, "~", RETURN_S)
    assert heard(hub, PENDANT) == ["ok"] and heard(hub, OWNER) == [] and hub.state() == "Idle"


def test_a_pendant_that_vanishes_behind_its_tool_change_is_answered_to_no_one(hub: HubHosts) -> None:
    hold_pendants(hub, "a tool change")
    put(hub, OWNER, "\xa3" + JOG)
    hub.lose_client(PENDANT)
    put(hub, OWNER, JOG + "~", RETURN_S)
    assert heard(hub, OWNER) == ["ok"] * 2 and hub.state() == "Idle"
    put(hub, OWNER, "G4P0\n")
    assert heard(hub, OWNER) == ["ok"]


@pytest.mark.alike(16)
@pytest.mark.parametrize("later_s", [0.0, 0.02])
@pytest.mark.parametrize("stop", STOPS)
@pytest.mark.parametrize("kept", [JOG + "~", "G38.3Y9F600\nG10L20P1Y0\n~", "~"])
@pytest.mark.parametrize("name", ["a tool change", "the job's own"])
def test_no_stop_starts_what_is_kept(hub: HubHosts, name: str, kept: str, stop: str, later_s: float) -> None:
    """A `~` behind the operator's lines, and a stop in the same moment or a little later."""
    if name == "the job's own":
        put(hub, OWNER, "G91G1X5F600\nM0\nG1X5\n", 1)
    else:
        hold_pendants(hub, name)
    put(hub, OWNER, "\xa3", 0.1)
    at = hub.position()[0]
    if kept == "~":
        put(hub, OWNER, "$J=G91Y3F60\n")  # 3 s: the ~ waits for its end
    hub.put_of(OWNER, kept)
    hub.passes(later_s)
    STOPS[stop](hub)
    hub.passes(4)
    assert hub.position()[0] == at, "nothing of the job runs"
    assert hub.state() != "Run"
    if "lost" in stop or "e-stop" in stop or stop == "reset":
        return
    put(hub, SECOND if stop == "taken" else OWNER, "~", 1)
    put(hub, PENDANT, "~", RETURN_S)  # behind a door the first leads back to the operator's hold
    assert hub.state() == "Idle", "a ~ from after it leads on"
