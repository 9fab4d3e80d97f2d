"""One conversation with a controller: connect, ask, answer, look. Keeps what the last reports said."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

from wificnc.connection import realtime
from wificnc.connection.condition import UNLOCK_RESET, Condition, condition, of_alarm
from wificnc.connection.grbl import (
    Alarm,
    Banner,
    Bracket,
    Error,
    LineSplitter,
    Message,
    Ok,
    Options,
    SettingLine,
    Status,
    parse,
    parse_coordinates,
    parse_options,
)
from wificnc.connection.transport import SerialTransport, Transport, open_transport
from wificnc.connection.typed import wire_line
from wificnc.connection.words import ERRORS
from wificnc.errors import LinkError, ProtocolError, RefusedError

CONNECT_S = 5.0  # a board that resets when its port is opened needs two of them
HELD = ("Hold", "Door", "Tool")  # lines wait
ANSWER_S = 5.0
ASK_EVERY_S = 0.5
NOTICE_S = 2.0  # for the answer to $I
OKS_OF_NOTICES = 2  # $ and $I
POLL_EVERY_S = 0.2  # status reports while something moves
WCO_EVERY = 30  # reports of a busy machine
FALLBACK_RX_BYTES = 120  # a controller that does not say: Grbl's 128, less a reserve

# What stops half a line of someone who vanished from being run together with ours: an error in every position.
BREAK_HALF_LINE = b")$\n"
LOCKED_ERROR = 9  # locked by an alarm
DAMAGED_ERROR = 7
DOOR_ERROR = 13
LOCKED = "Locked: log in"  # what a controller tells a client that is not logged in
OBSERVER = "Observer:"  # what a server of several clients reports to all but one
NOBODY = "No client is in control"  # ... when that one has left
TAKE_OVER = b"$TAKE\n"
ECHO_REQUEST = b"$\n"  # answered with [HLP:…] and ok in every state


def error_words(code: int) -> str:
    """error:22 the feed rate is missing (F)"""
    return f"error:{code} {ERRORS.get(code, 'unknown error')}"


def alarm_error(doing: str, code: int) -> RefusedError:
    """An alarm in place of an answer, with the way out."""
    found = of_alarm(code)
    return RefusedError(f"{doing}: {found.why}", hint=found.next)


@dataclass(frozen=True)
class Target:
    """Where a controller is, and whether to take it over from a client that commands it now."""

    url: str
    take: bool = False

    def __str__(self) -> str:
        return self.url


@dataclass(frozen=True)
class Snapshot:
    """Where the machine is, put together from the last reports."""

    status: Status
    wco: tuple[float, ...]
    overrides: tuple[int, int, int] | None
    accessories: str
    homed: str = ""  # "1", or "0," and a mask of the axes that are; "" = not reported

    @property
    def mpos(self) -> tuple[float, ...]:
        """Machine position, in the unit of the reports."""
        if self.status.mpos is not None:
            return self.status.mpos
        return tuple(work + offset for work, offset in zip(self.status.wpos or (), self._offsets(), strict=False))

    @property
    def wpos(self) -> tuple[float, ...]:
        """Work position, in the unit of the reports."""
        if self.status.wpos is not None:
            return self.status.wpos
        return tuple(round(at - offset, 6) for at, offset in zip(self.status.mpos or (), self._offsets(), strict=False))

    @property
    def state(self) -> str:
        """Idle, Hold:0, …"""
        sub = self.status.substate
        return self.status.state if sub is None else f"{self.status.state}:{sub}"

    def _offsets(self) -> tuple[float, ...]:
        count = len(self.status.mpos or self.status.wpos or ())
        return (*self.wco, *[0.0] * count)[:count]


@dataclass(frozen=True)
class Answer:
    """What one line brought: 0 or the error's number, and all messages before it."""

    code: int
    messages: tuple[Message, ...]

    def brackets(self, key: str) -> list[str]:
        return bodies(self.messages, key)


def bodies(messages: Sequence[Message], key: str) -> list[str]:
    """What is in the brackets of this key."""
    return [message.body for message in messages if isinstance(message, Bracket) and message.key == key]


def who_commands(message: Message) -> str | None:
    """Another client, when this message reports that it commands and our lines are not taken."""
    if isinstance(message, Bracket) and message.key == "MSG" and message.body.startswith(OBSERVER):
        return message.body.removeprefix(OBSERVER).partition(" is in control")[0].strip()
    return None


class ControllerReset(LinkError):
    """The controller started again in the middle of a conversation."""


class Client:
    """Owns a transport. Not thread-safe."""

    def __init__(self, transport: Transport, clock: Callable[[], float] = time.monotonic, take: bool = False) -> None:
        self.transport = transport
        self.take = take
        self.clock = clock
        self.banner: Banner | None = None
        self.snapshot: Snapshot | None = None
        self.reports = 0
        self.notices: tuple[str, ...] | None = None  # messages before the first report; None = not connected yet
        self.heard = clock()  # when bytes last came
        self._splitter = LineSplitter()

    # ---- bytes ----

    def wait(self, timeout_s: float, others: Sequence[int] = ()) -> None:
        self.transport.wait(timeout_s, others)

    def receive(self) -> list[Message]:
        """Messages that have come; reports are also kept as the snapshot. Never waits. Raises LinkError."""
        data = self.transport.receive()
        if not data:
            return []
        self.heard = self.clock()
        messages = [parse(line) for line in self._splitter.take(data)]
        for message in messages:
            if isinstance(message, Status):
                self._look(message)
            elif isinstance(message, Banner):
                self.banner = message
        return messages

    def send(self, data: bytes) -> None:
        self.transport.send(data)

    def close(self) -> None:
        self.transport.close()

    def _look(self, status: Status) -> None:
        before = self.snapshot
        self.reports += 1
        self.snapshot = Snapshot(
            status,
            status.wco if status.wco is not None else before.wco if before else (),
            status.overrides or (before.overrides if before else None),
            status.accessories if status.overrides else before.accessories if before else "",
            dict(status.other).get("H") or (before.homed if before else ""),
        )

    # ---- conversation ----

    def connect(self, patience_s: float | None = None) -> Snapshot:
        """Ask for a status report until one comes.

        Raises:
            LinkError: no one answers.
            RefusedError: an alarm of a controller that is mute until a reset.
            ProtocolError: what answers is not a Grbl controller.
        """
        said: list[Message] = []
        for message in self._asking(CONNECT_S if patience_s is None else patience_s):
            if isinstance(message, Status):
                self.notices = tuple(bodies(said, "MSG")) if self.notices is None else self.notices
                return self.now()
            said.append(message)
        name = self.transport.name
        if any(isinstance(message, Bracket) and message.body == "Reset to continue" for message in said):
            # Grbl itself answers nothing more; WiFiCNC does.
            raise RefusedError(f"{name} is in an alarm that requires a reset", hint=UNLOCK_RESET)
        if not said:
            raise LinkError(f"{name} does not answer", hint="check that it is a controller, and its baud rate")
        raise ProtocolError(f"{name} does not answer like a Grbl controller: {said[0]}")

    def _asking(self, patience_s: float) -> Iterator[Message]:
        """Messages of the next while, with a question for the status every now and then."""
        deadline, ask_at = self.clock() + patience_s, self.clock()
        while self.clock() < deadline:
            if self.clock() >= ask_at:
                self.send(realtime.STATUS)
                ask_at = self.clock() + ASK_EVERY_S
            self.wait(min(ask_at, deadline) - self.clock())
            yield from self.receive()

    def now(self) -> Snapshot:
        """The last report. connect() has seen one."""
        assert self.snapshot
        return self.snapshot

    def look(self) -> Snapshot:
        """A report that was asked for now. Raises LinkError."""
        return self.connect(ANSWER_S)

    def look_fully(self) -> Snapshot:
        """Reports until they have had the work offset and the overrides, which are in one of many."""
        for _ in range(WCO_EVERY + 2):
            now = self.look()
            if now.overrides and (now.wco or now.status.wpos is not None):
                break
        return now

    def synchronise(self) -> None:
        """Make sure that the next answer belongs to our next line, whatever was sent before us.

        Raises:
            LinkError: the controller does not answer lines.
            RefusedError: another client commands it, it wants its access key, or a hold keeps lines waiting.
        """
        self.send((TAKE_OVER if self.take else b"") + BREAK_HALF_LINE + ECHO_REQUEST)
        echoed = False
        for message in self._asking(ANSWER_S):
            if isinstance(message, Bracket) and message.key == "HLP":
                echoed = True
            elif isinstance(message, Ok) and echoed:
                return
            self.expect_control(message)
        if (now := self.now()).status.state in HELD:
            found = self.condition()
            why = f"{self.transport.name} is in state {now.state} and answers no lines until that ends: {found.why}"
            raise RefusedError(why, hint=found.next)
        raise LinkError(f"{self.transport.name} reports its state but does not answer lines")

    def expect_control(self, message: Message) -> None:
        """Raises RefusedError: by this message our lines and resets are not taken."""
        if (other := who_commands(message)) is not None:
            raise RefusedError(f"another client is in control: {other}", hint="--take takes control")
        if isinstance(message, Bracket) and message.body.startswith(LOCKED):
            raise RefusedError(f"{self.transport.name} is locked", hint=self.login_hint())

    def command(
        self,
        line: str,
        patience_s: float = ANSWER_S,
        others: Sequence[int] = (),
        tick: Callable[[], None] | None = None,
    ) -> Answer:
        """Send one line and wait for its answer; nothing else may be under way.

        @param patience_s how long the controller may be silent; it is asked for its status all the while
        @param tick called now and then while waiting

        Raises:
            LinkError: no answer. ControllerReset: a reset instead of one.
            RefusedError: an alarm instead of one.
            UserError: the line holds what would act as a real-time command; nothing was sent.
        """
        self.send(wire_line(line))
        messages: list[Message] = []
        ask_at = self.heard = self.clock()
        while self.clock() - self.heard < patience_s:
            if self.clock() >= ask_at + POLL_EVERY_S:
                self.send(realtime.STATUS)
                ask_at = self.clock()
            self.wait(POLL_EVERY_S, others)
            for message in self.receive():
                if isinstance(message, (Ok, Error)):
                    return Answer(message.code if isinstance(message, Error) else 0, tuple(messages))
                self._expect_answer(line, message)
                messages.append(message)
            if tick:
                tick()
        raise LinkError(f"{self.transport.name} has not answered {line!r}")

    def _expect_answer(self, line: str, message: Message) -> None:
        if isinstance(message, Banner):
            raise ControllerReset(f"{self.transport.name} was reset while it worked on {line!r}")
        if isinstance(message, Alarm):
            raise alarm_error(line, message.code)

    def must(self, line: str, patience_s: float = ANSWER_S) -> Answer:
        """command(), with a RefusedError when the answer is an error."""
        answer = self.command(line, patience_s)
        if answer.code:
            raise RefusedError(f"the controller refuses {line!r}: {error_words(answer.code)}")
        return answer

    def leave_alarm(self, line: str, answer: Answer) -> None:
        """Check the answer to `$X` or `$H`.

        Raises:
            RefusedError: the line was refused; with the cause, and what leads on.
        """
        if not answer.code:
            return
        hints = {LOCKED_ERROR: UNLOCK_RESET, DOOR_ERROR: "close the door, then send it again"}
        if answer.code in (LOCKED_ERROR, DAMAGED_ERROR):
            now = self.condition(commands=True)
            raise RefusedError(f"{line} is refused: {now.why}", hint=now.next)
        raise RefusedError(f"{line} is refused: {error_words(answer.code)}", hint=hints.get(answer.code))

    # ---- questions ----

    def is_locked_out(self) -> bool:
        """Whether the controller requires its access key first, as it has reported up to the first report."""
        return any(body.startswith(LOCKED) for body in self.notices or ())

    def login_hint(self) -> str:
        """How to log in to this controller."""
        place = self.transport.name.removeprefix("tcp://")
        return f"`wificnc login {place}` (docs/security.md: where to find the access key), or --to :KEY@{place}"

    def commander(self) -> str | None:
        """Another client that commands, as the controller has reported it up to the first report."""
        name = None
        for body in self.notices or ():
            name = None if body.startswith(NOBODY) else who_commands(Bracket("MSG", body)) or name
        return name

    def condition(self, commands: bool = False) -> Condition:
        """Why the machine does not work now: from the notices, or in an alarm from `$I`.

        @param commands this client commands; `$I` takes nothing from others then, as on a serial port
        """
        status = self.now().status
        found = condition(status, self.notices or ())
        may_ask = commands or isinstance(self.transport, SerialTransport)
        if status.state == "Alarm" and found == condition(status) and may_ask:
            return condition(status, self._ask_notices())
        return found

    def _ask_notices(self) -> list[str]:
        """The messages of `$I`; as many as come, also when it is not answered. Raises LinkError."""
        self.send(BREAK_HALF_LINE + ECHO_REQUEST + b"$I\n")
        deadline, oks, found = self.clock() + NOTICE_S, 0, list[Message]()
        while oks < OKS_OF_NOTICES and self.clock() < deadline:
            self.wait(deadline - self.clock())
            came = self.receive()
            found += came
            oks += sum(isinstance(message, Ok) for message in came)
        return bodies(found, "MSG")

    def options(self) -> Options | None:
        """[OPT:…] of $I; None when the controller does not say."""
        bodies = self.command("$I").brackets("OPT")
        return parse_options(bodies[-1]) if bodies else None

    def start_id(self) -> str:
        """[START:…] of $I, which each start of the controller has another one of; "" when it does not tell."""
        bodies = self.command("$I").brackets("START")
        return bodies[-1] if bodies else ""

    def settings(self) -> dict[int, str]:
        """All settings as $$ prints them. Raises RefusedError."""
        return {
            message.number: message.value for message in self.must("$$").messages if isinstance(message, SettingLine)
        }

    def offsets(self) -> dict[str, tuple[float, ...]]:
        """G54 … G59, G28, G30, G92, TLO of $#; empty when the controller does not tell."""
        answer = self.command("$#")
        found = {
            message.key: parse_coordinates(message.body) for message in answer.messages if isinstance(message, Bracket)
        }
        return {key: values for key, values in found.items() if values is not None}

    def parser_state(self) -> list[str]:
        """The words of [GC:…]; empty when the controller does not tell."""
        bodies = self.command("$G").brackets("GC")
        return bodies[-1].split() if bodies else []


@contextmanager
def connected(target: str | Target) -> Iterator[Client]:
    """A client that has seen a status report. Closed at the end, whatever happens."""
    client = Client(open_transport(str(target)), take=isinstance(target, Target) and target.take)
    try:
        client.connect()
        yield client
    finally:
        client.close()


def unit_mm(settings: dict[int, str]) -> float:
    """Millimetres in the unit of the reports: inches with $13=1."""
    return 25.4 if settings.get(13) == "1" else 1.0


def expect_state(client: Client, *allowed: str) -> Snapshot:
    """The state now, if it is one of these. Raises RefusedError, with the cause, and the way out as its hint."""
    now = client.look()
    if now.status.state in allowed:
        return now
    found = client.condition()
    raise RefusedError(
        f"{client.transport.name} is in state {now.state} and must be in {' or '.join(allowed)} for this: {found.why}",
        hint=found.next,
    )
