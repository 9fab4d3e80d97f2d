"""Who gets status reports behind the network's server, whoever reads its answers or not."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from hub_hosts import HubHosts

OWNER, OBSERVER, OTHER = range(3)
LINES = 40  # of the owner; the answers to a few fill its queue


@pytest.fixture
def hub() -> Iterator[HubHosts]:
    """The owner has sent more than it reads answers of, so none of its lines is read any more."""
    made = HubHosts()
    made.heard()
    made.fine("G21")
    for place in (OBSERVER, OTHER):
        made.put_of(place, "?")
    made.after(0.1)
    made.heard_of(OWNER)
    made.stalled = {OWNER}
    made.put("$$\n" * LINES)
    for _ in range(LINES):
        made.after(0.01)
    assert made.waits_of(OWNER) > 3 * LINES / 2
    for place in (OBSERVER, OTHER):
        made.heard_of(place)
    yield made
    made.stalled = set()
    made.close()


def reports(said: str) -> int:
    return sum(line.startswith("<Idle|") for line in said.splitlines())


@pytest.mark.parametrize("ask", ["?", "\x87"])
def test_observers_get_reports_while_the_owner_does_not_read(hub: HubHosts, ask: str) -> None:
    for place in (OBSERVER, OTHER):
        hub.put_of(place, ask)
        hub.after(0.1)
        assert reports(hub.heard_of(place)) == 1


def test_automatic_reports_continue_too(hub: HubHosts) -> None:
    hub.put_of(OBSERVER, "$RI=100\n")
    hub.after(1)
    assert 9 <= reports(hub.heard_of(OBSERVER)) <= 10


@pytest.mark.parametrize("ask", ["?", "\x87"])
def test_the_owner_is_answered_when_it_reads_again(hub: HubHosts, ask: str) -> None:
    """Once, and reports for others, however many, do not end its connection."""
    hub.put(ask)
    for _ in range(400):
        hub.put_of(OBSERVER, "?")
        hub.after(0.01)
    assert hub.heard_of(OBSERVER).count("<") == 400
    hub.stalled = set()
    said = hub.after(1)
    assert said.count("<") == 1 and said.count("ok\r\n") == LINES and "MSG" not in said
