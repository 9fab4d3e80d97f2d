"""`$TAKE` of another client, in every state: it has control within one round, what moves is held, and lines of the
former owner that have not begun do not run."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from generate.states_table import load_states
from hub_hosts import HubHosts
from state_machine import SETTLED_S, SITUATIONS, answers, in_order
from test_states_server import ServerPair

TABLE = load_states()
IN_CONTROL = "[MSG:In control]"
TAKEN = "[MSG:Observer: client is in control, $TAKE takes control]"
UNREAD = 40  # lines of the former owner
ROOM = "G1X5Y5F600\n"


@pytest.fixture
def pair() -> Iterator[ServerPair]:
    made = ServerPair(TABLE)
    made.server.put_of(1, "?")  # who says nothing is disconnected
    made.server.heard_of(1)
    yield made
    made.close()


def take(hub: HubHosts, place: int = 1) -> str:
    """What the taker receives within one round trip, with the answer to its `?`."""
    hub.heard_of(place)
    hub.put_of(place, "$TAKE\n")
    return hub.heard_of(place)


@pytest.mark.parametrize("situation", SITUATIONS)
def test_the_taker_is_in_control_within_one_round(pair: ServerPair, situation: str) -> None:
    pair.reach(situation)
    hub = pair.server
    said = take(hub)
    assert IN_CONTROL in said and answers(said[said.index(IN_CONTROL) :])[:1] == ["ok"], said
    assert TAKEN in hub.heard_of(0)


@pytest.mark.parametrize("situation", SITUATIONS)
def test_state_motion_and_outputs_are_those_of_the_table(pair: ServerPair, situation: str) -> None:
    pair.reach(situation)
    expected = pair.model.apply("take_line")
    said = take(pair.server)
    answered = pair.server.after(SETTLED_S)
    assert in_order(said + answered, expected.says), f"{said!r}, and the former owner {answered!r}, not {expected.says}"
    pair.compare(situation)


def taker(hub: HubHosts, lines: str, seconds: float) -> tuple[list[str], list[str]]:
    """What the former owner is answered, who hears the taker's answers, too; and the taker."""
    hub.heard_of(1)
    hub.put_of(1, lines)
    former = answers(hub.after(seconds))
    return former, answers(hub.heard_of(1))


@pytest.mark.alike(2)
@pytest.mark.parametrize("situation", ["run", "run, dwell", "run, line open", "hold, M0", "hold, move", "hold, probe"])
def test_lines_that_have_not_begun_are_refused_behind_the_open_one(pair: ServerPair, situation: str) -> None:
    """Each line has one answer, in order, whatever the look-ahead took; the taker's lines come behind all of them."""
    pair.reach(situation)
    hub, waits = pair.server, pair.model.open_line
    said = answers(hub.after(0.05, ROOM * UNREAD))
    take(hub)
    said += answers(hub.after(0.1))
    former, answered = taker(hub, "~$G\n$G\n", 900)
    said += former
    first, count = said.index("error:181"), UNREAD + waits
    assert set(said[:first]) <= {"ok"} and said[first:count] == ["error:181"] * (count - first)
    assert said[count:] == answered == ["ok", "ok"]
    assert first < UNREAD // 2 + 1


def test_control_taken_back_is_answered_behind_the_refused_lines(pair: ServerPair) -> None:
    pair.reach("hold, M0")
    hub = pair.server
    hub.after(0.1, ROOM * 3)
    take(hub)
    hub.after(0.1, "G1X9\n")  # as an observer
    assert IN_CONTROL in take(hub, 0)
    assert answers(hub.after(0.1)) == []
    assert answers(hub.after(5, "~$G\n")) == ["ok", *["error:181"] * 4, "ok", "ok"]
    assert hub.position() == hub.stands() and hub.state() == "Idle"


def test_half_a_line_is_never_continued(pair: ServerPair) -> None:
    pair.reach("idle")
    hub = pair.server
    hub.after(0.1, "G1X1F60")
    assert answers(take(hub)) == ["ok"]
    assert answers(hub.after(0.1, "00\n")) == ["error:181"]
    assert taker(hub, "Y1F600\n", 1)[1] == ["ok"]
    assert hub.position()[0] == 0


def test_lines_of_a_lost_sender_do_not_run(pair: ServerPair) -> None:
    pair.reach("hold, M0")
    hub = pair.server
    hub.after(0.1, ROOM * UNREAD)
    hub.lose_client(0)
    assert answers(take(hub)) == ["ok"]
    assert taker(hub, "~$G\n", 9)[1] == ["ok"] and hub.state() == "Idle"
    assert hub.position()[:2] == [0, 0]


@pytest.mark.parametrize("ahead", [0, 8, 60])
def test_in_a_parked_hold_the_jobs_lines_are_dropped_and_the_operators_answered(pair: ServerPair, ahead: int) -> None:
    pair.reach("hold, M0")
    hub = pair.server
    hub.after(0.1, ROOM * ahead)
    hub.after(0.2, "\xa3$J=G91Y1F600\n")
    hub.heard_of(1)
    assert answers(take(hub)) == ["ok"]
    assert taker(hub, "$J=G91Y1F600\n", 1)[1] == ["ok"]
    assert taker(hub, "~", 20)[0] == ["ok", *["error:181"] * ahead]
    assert hub.position()[:2] == [0, 0] and hub.state() == "Idle"


def test_who_takes_control_where_no_client_has_it_learns_that_it_has(pair: ServerPair) -> None:
    """By its first byte it has control already. Who had it before the line reads only ok."""
    hub = pair.server
    hub.lose_client(0)
    assert IN_CONTROL in take(hub)
    assert IN_CONTROL not in take(hub)
    hub.put_of(2, "$TAKE\n")
    assert IN_CONTROL in hub.heard_of(2)
    assert IN_CONTROL in take(hub)
