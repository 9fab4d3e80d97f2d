"""Whether the machine is at rest, from its status reports, and waiting until it does."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from wificnc.connection import realtime
from wificnc.connection.client import POLL_EVERY_S, Client, ControllerReset, Snapshot, alarm_error
from wificnc.connection.grbl import Alarm, Banner, Message, Status
from wificnc.errors import LinkError, RefusedError

SILENCE_S = 10.0  # no bytes for this long, although asked five times a second: the link is dead


@dataclass
class Rest:
    """Two reports in a row of one state at one place: the machine is at rest."""

    reports: int = 0
    seen: tuple[object, ...] = field(default=())

    def look(self, snapshot: Snapshot) -> None:
        status = snapshot.status
        now = (snapshot.state if status.substate else status.state, snapshot.mpos)
        self.reports = self.reports + 1 if now == self.seen else 1
        self.seen = now

    def stands_in(self, *states: str) -> bool:
        """States as in a report; sub-state 0 is left out."""
        return self.reports >= 2 and self.seen[0] in states


def wait_rest(
    client: Client,
    cancel: bytes = b"",
    interrupted: Callable[[], bool] = lambda: False,
    others: Sequence[int] = (),
    on_look: Callable[[Snapshot], None] | None = None,
) -> Snapshot:
    """Until the machine is idle. When interrupted() says so, send the cancel bytes and continue waiting.

    Raises:
        RefusedError: an alarm ended the motion.
        LinkError: the controller is silent, or was reset.
    """
    rest, ask_at = Rest(), client.clock()
    client.heard = ask_at
    while not rest.stands_in("Idle"):
        if interrupted():
            client.send(cancel)
        if client.clock() >= ask_at:
            client.send(realtime.STATUS)
            ask_at = client.clock() + POLL_EVERY_S
        client.wait(ask_at - client.clock(), others)
        for message in client.receive():
            _expect_motion(client, message)
            if isinstance(message, Status):
                rest.look(client.now())
                if on_look:
                    on_look(client.now())
        if client.clock() - client.heard > SILENCE_S:
            raise LinkError(f"{client.transport.name} has not answered for {SILENCE_S:.0f} s")
    return client.now()


def _expect_motion(client: Client, message: Message) -> None:
    if isinstance(message, Banner):
        raise ControllerReset(f"{client.transport.name} was reset while the machine moved")
    if isinstance(message, Alarm):
        raise alarm_error("the motion was stopped", message.code)
    if isinstance(message, Status) and message.state == "Alarm":
        found = client.condition(commands=True)
        raise RefusedError(f"the motion was stopped: {found.why}", hint=found.next)
