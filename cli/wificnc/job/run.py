"""A job on its way: streams lines, watches the answers, acts on keys, and always has what became of each line.

RUNNING ──!──► HELD ──~──► RUNNING ──all answered──► FINISHING ──at rest──► finished
   │ error, Ctrl-C, q                                     │
   ▼                                                      ▼
ASKING ──resume──► RUNNING          any state: ALARM, banner, link gone ──► ended, with the lines' fates
   │ stop (or no one to ask)
   ▼
STOPPING: hold, wait until nothing moves, then reset: so the position is kept
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Protocol

from wificnc.connection import realtime
from wificnc.connection.alarms import alarm_words
from wificnc.connection.character_counting import Streamer
from wificnc.connection.client import FALLBACK_RX_BYTES, POLL_EVERY_S, Client, Snapshot, error_words, who_commands
from wificnc.connection.grbl import Alarm, Banner, Bracket, Error, Ok, Options, Status
from wificnc.connection.rest import SILENCE_S, Rest
from wificnc.errors import JobError, LinkError
from wificnc.job.program import JobLine
from wificnc.job.shown import Written

STOP_S = 10.0  # a feed hold that takes longer than this is ended by a reset
BANNER_S = 3.0
OVERFLOW = "Receive buffer overflow"
ALARM_RESET = 3
STANDING = ("Hold", "Tool", "Idle", "Door", "Door:1", "Check", "Sleep", "Alarm")  # :0 is left out
CTRL_C = "\x03"
TERMINATED = "\x00"  # the process is asked to end: hold and reset, without a question
RESTARTED = "the controller was switched off or restarted: its position is lost"

PLAIN_KEYS = {
    "!": realtime.HOLD,
    "~": realtime.RESUME,
    "+": realtime.FEED_PLUS_10,
    "=": realtime.FEED_PLUS_10,
    "-": realtime.FEED_MINUS_10,
    "0": realtime.FEED_100,
}


class Phase(Enum):
    RUNNING = "running"
    ASKING = "asking"
    STOPPING = "stopping"
    RESETTING = "resetting"
    ENDED = "ended"


class End(Enum):
    """How a job ended."""

    FINISHED = "finished"
    STOPPED = "stopped"  # by the operator
    ERROR = "error"  # a line was refused
    ALARM = "alarm"
    RESET = "reset"  # the controller started again by itself
    LINK_LOST = "link lost"
    TAKEN = "another client took control"
    CONFUSED = "confused"  # answers and lines no longer belong together


@dataclass(frozen=True)
class LineError:
    """A line that the controller refused."""

    line: JobLine
    code: int

    def title(self, file: str) -> str:
        """job.nc:12: error:22 the feed rate is missing (F)"""
        place = f"{file}:{self.line.number}" if self.line.number else "resume"
        return f"{place}: {error_words(self.code)}"


@dataclass(frozen=True)
class Progress:
    """How far the job is, for a display."""

    phase: Phase
    question: str
    answered: int
    lines: int
    line: int  # of the file: the one being made where reports tell, else the last one answered
    elapsed_s: float
    total_s: float | None
    remaining_s: float | None
    snapshot: Snapshot
    under_way: int
    rx_bytes: int
    errors: int

    @property
    def share(self) -> float:
        """0 .. 1: of the time when that is known, else of the lines."""
        if self.total_s and self.remaining_s is not None:
            return 1.0 - self.remaining_s / self.total_s
        return self.answered / self.lines if self.lines else 1.0


@dataclass(frozen=True)
class Outcome:
    """What became of a job."""

    end: End
    detail: str
    lines: int
    sent: int
    answered: int
    last_answered: JobLine | None
    last_accepted: JobLine | None  # answered with ok
    refused: JobLine | None  # the line that stopped the job
    unanswered: tuple[JobLine, ...]
    errors: tuple[LineError, ...]
    elapsed_s: float
    snapshot: Snapshot
    planner_blocks: int
    messages: tuple[str, ...]

    running: JobLine | None  # the line that was being made when the machine was last heard of, where reports tell

    @property
    def complete(self) -> bool:
        return self.end is End.FINISHED and not self.errors


class Watcher(Protocol):
    """Gets the events of a job. All methods return immediately."""

    def progress(self, progress: Progress) -> None:
        """Some times a second."""

    def error(self, error: LineError) -> None:
        """A line was refused."""

    def message(self, text: str) -> None:
        """The controller, or the job, has something to say."""


class Keys(Protocol):
    """Who may intervene."""

    interactive: bool  # someone is there to be asked

    def fds(self) -> Sequence[int]:
        """What wakes the job up."""

    def read(self) -> str:
        """Keys since the last call. Never waits."""


class JobTimes(Protocol):
    """How long the job takes, as far as it is known: simulator/estimate.py."""

    @property
    def total_s(self) -> float | None:
        """Of the whole job; None = not known (yet)."""

    def remaining_s(self, answered: int, since_s: float = 0.0) -> float | None:
        """What is left, this long after so many lines were answered; None = not known (yet)."""


@dataclass
class RunOptions:
    """Of one run."""

    options: Options | None = None  # what $I said
    keep_going: bool = False
    check: bool = False  # check mode: nothing moves
    times: JobTimes | None = None
    numbered: bool = False  # the lines carry their numbers, so Ln: is the number of a line
    written: Written = str  # what a message about a comment is in the file
    preamble: int = 0  # lines at the beginning that must not fail, --keep-going or not


@dataclass
class _Wish:
    """What happens once nothing moves any more."""

    end: End
    detail: str
    deadline: float = 0.0


class JobRun:
    """One job over one client. run() does it all."""

    def __init__(
        self, client: Client, lines: Sequence[JobLine], watcher: Watcher, keys: Keys, options: RunOptions | None = None
    ) -> None:
        self.client = client
        self.options = options or RunOptions()
        self.watcher = watcher
        self.keys = keys
        self.lines = lines
        capacity = self.options.options.rx_bytes if self.options.options else FALLBACK_RX_BYTES
        self.streamer: Streamer[JobLine] = Streamer(lines, capacity)
        self.phase = Phase.RUNNING
        self.errors: list[LineError] = []
        self.messages: list[str] = []
        self._question = ""
        self._wish: _Wish | None = None
        self._end: tuple[End, str] | None = None
        self._rest = Rest()
        self._ctrl_c = 0
        self._confirm_reset = False
        self._paused = False
        self._running = 0
        self._start_id = ""
        self._last_accepted: JobLine | None = None
        self._refused: JobLine | None = None
        self._handlers: dict[type, Callable[..., None]] = {
            Ok: self._on_answer, Error: self._on_answer, Alarm: self._on_alarm, Banner: self._on_banner,
            Bracket: self._on_bracket, Status: self._on_status,
        }  # fmt: skip
        _check_lengths(lines, capacity)

    def run(self) -> Outcome:
        """Until the job has ended, one way or another."""
        self._begin = self.client.heard = self.client.clock()
        self._ask_at = self._answered_at = self._begin
        self.client.send(realtime.FULL_STATUS)  # which start of the controller this is
        try:
            while self._end is None:
                self._round()
        except LinkError as err:
            self._end = (End.LINK_LOST, err.message)
        self.phase = Phase.ENDED
        self._tell_progress()
        return self._outcome(*self._end)

    def _round(self) -> None:
        if self.phase is Phase.RUNNING:
            at_rest = self._rest.stands_in("Idle", "Check")
            if data := self.streamer.take(at_rest):
                self._rest = Rest()
                self.client.send(data)
        now = self.client.clock()
        if now >= self._ask_at:
            self.client.send(realtime.STATUS)
            self._ask_at = now + POLL_EVERY_S
            self._tell_progress()
        self.client.wait(self._ask_at - now, self.keys.fds())
        for key in self.keys.read():
            self._on_key(key)
        for message in self.client.receive():
            if self._end is None and (handler := self._handlers.get(type(message))):
                handler(message)
        self._watch_time()

    # ---- what the controller says ----

    def _on_answer(self, message: Ok | Error) -> None:
        if self.phase is Phase.RESETTING:
            return  # a reset causes an ok for the line that it ends
        line = self.streamer.answer()
        self._answered_at = self.client.clock()
        self._rest = Rest()
        if line is None:
            self._stop(End.CONFUSED, "the controller answered a line that was not sent")
        elif isinstance(message, Error):
            self._on_line_error(LineError(line, message.code))
        else:
            self._last_accepted = line

    def _on_line_error(self, error: LineError) -> None:
        self.errors.append(error)
        self.watcher.error(error)
        must_stop = self.streamer.answered <= self.options.preamble
        if self.phase is not Phase.RUNNING or (self.options.keep_going and not must_stop):
            return
        self._refused = error.line
        if self.keys.interactive and not must_stop:
            self._hold_and_ask(f"{error.line.title} was refused. c: continue without it   x: stop and reset")
        else:
            self._stop(End.ERROR, error_words(error.code))

    def _on_alarm(self, message: Alarm) -> None:
        if message.code == ALARM_RESET and self.phase is not Phase.RESETTING:
            self._end = (End.RESET, "the controller was reset while the machine moved; its position may be lost")
        elif self.phase is not Phase.RESETTING:
            self._end = (End.ALARM, f"ALARM:{message.code} {alarm_words(message.code)}")

    def _on_banner(self, message: Banner) -> None:
        if self.phase is Phase.RESETTING and self._wish:
            self._end = (self._wish.end, self._wish.detail)
        else:
            self._end = (End.RESET, "the controller was reset")

    def _on_bracket(self, message: Bracket) -> None:
        if (other := who_commands(message)) is not None:
            self._end = (End.TAKEN, f"another client has taken control: {other}")
        if message.key == "MSG":
            if message.body == OVERFLOW:
                self._stop(End.CONFUSED, "the controller's receive buffer overflowed, and lines were lost")
            body = self.options.written(message.body)
            self.messages.append(body)
            self.watcher.message(body)

    def _on_status(self, status: Status) -> None:
        snapshot = self.client.now()
        self._rest.look(snapshot)
        self._notice_restart(status)
        if self.options.numbered and status.line and status.state in ("Run", "Hold", "Tool", "Door"):
            self._running = status.line
        if status.rx_free is not None:
            self.streamer.window.hear_free(status.rx_free)
        self._notice_pause(status)
        if self.phase is Phase.STOPPING and self._rest.stands_in(*STANDING):
            self._reset()
        if self.phase is not Phase.RUNNING:
            return
        if status.state in ("Alarm", "Sleep"):
            self._end = (End.ALARM, f"the controller is in state {snapshot.state}")
        elif self.streamer.done and (self.options.check or self._rest.stands_in("Idle")):
            self._end = (End.FINISHED, "")

    def _notice_restart(self, status: Status) -> None:
        """Another start of the controller than the one that got the first lines."""
        start_id = dict(status.other).get("Start", "")
        if start_id and self._start_id not in ("", start_id):
            self._end = (End.RESET, RESTARTED)
        self._start_id = start_id or self._start_id

    def _notice_pause(self, status: Status) -> None:
        """M0, M1 and M6 wait for the operator: say what the program says."""
        paused = status.state in ("Hold", "Tool", "Door")
        front = self.streamer.under_way[0] if self.streamer.under_way else None
        if paused and not self._paused and front and "M" in front.code:
            self.watcher.message(f"{front.title}: the program pauses; ~ resumes")
        self._paused = paused

    # ---- what the operator says ----

    def _on_key(self, key: str) -> None:
        if key == TERMINATED:
            self._stop(End.STOPPED, "the sender was terminated")
        elif key == CTRL_C or (key == "q" and self.phase is Phase.RUNNING):
            self._on_ctrl_c()
        elif self._confirm_reset:
            self._on_reset_confirmation(key)
        elif self.phase is Phase.ASKING:
            self._on_answer_key(key)
        elif self.phase is Phase.RUNNING and key in PLAIN_KEYS:
            self.client.send(PLAIN_KEYS[key])
        elif self.phase is Phase.RUNNING and key == "x":
            self._confirm_reset = True
            self._question = (
                "Reset now? Moving axes stop immediately and lose their position. y: reset   any other key: continue"
            )
            self._tell_progress()

    def _on_ctrl_c(self) -> None:
        self._ctrl_c += 1
        if self._ctrl_c > 1:
            self._wish = _Wish(End.STOPPED, "reset by the operator")
            self._reset()
        elif not self.keys.interactive:
            self._stop(End.STOPPED, "stopped by the operator")
        else:
            self._hold_and_ask("Feed hold. r: resume   x: stop and reset   Ctrl-C: reset immediately")

    def _on_reset_confirmation(self, key: str) -> None:
        self._confirm_reset = False
        self._question = ""
        if key in "yY":
            self._wish = _Wish(End.STOPPED, "reset by the operator")
            self._reset()
        elif key in "!~":
            self.client.send(PLAIN_KEYS[key])

    def _on_answer_key(self, key: str) -> None:
        if key in "rRcC~":
            self._ctrl_c = 0
            self._refused = None
            self._question = ""
            self.phase = Phase.RUNNING
            self.client.send(realtime.RESUME)
        elif key in "xXsS":
            end = End.ERROR if self.errors and not self._ctrl_c else End.STOPPED
            self._stop(end, "stopped by the operator")

    # ---- what is done about it ----

    def _hold_and_ask(self, question: str) -> None:
        self.client.send(realtime.HOLD)
        self._confirm_reset = False
        self.phase = Phase.ASKING
        self._question = question
        self._tell_progress()

    def _stop(self, end: End, detail: str) -> None:
        """Hold, wait until nothing moves, reset."""
        if self.phase in (Phase.STOPPING, Phase.RESETTING):
            return
        self.client.send(realtime.HOLD)
        self._rest = Rest()
        self._wish = _Wish(end, detail, self.client.clock() + STOP_S)
        self.phase = Phase.STOPPING
        self._question = ""

    def _reset(self) -> None:
        assert self._wish
        self.client.send(realtime.RESET)
        self._wish.deadline = self.client.clock() + BANNER_S
        self.phase = Phase.RESETTING
        self._question = ""

    def _watch_time(self) -> None:
        now = self.client.clock()
        if self.phase is Phase.STOPPING and self._wish and now > self._wish.deadline:
            self._reset()
        elif self.phase is Phase.RESETTING and self._wish and now > self._wish.deadline:
            self._end = self._end or (self._wish.end, f"{self._wish.detail}; the controller did not confirm the reset")
        elif now - self.client.heard > SILENCE_S:
            raise LinkError(f"{self.client.transport.name} has not answered for {SILENCE_S:.0f} s")

    def _tell_progress(self) -> None:
        times = self.options.times
        answered = self.streamer.answered
        now = self.client.clock()
        last = self.streamer.last_answered
        self.watcher.progress(
            Progress(
                phase=self.phase,
                question=self._question,
                answered=answered,
                lines=len(self.lines),
                line=self._running or (last.number if last else 0),
                elapsed_s=now - self._begin,
                total_s=times.total_s if times else None,
                remaining_s=times.remaining_s(answered, now - self._answered_at) if times else None,
                snapshot=self.client.now(),
                under_way=self.streamer.window.under_way,
                rx_bytes=self.streamer.window.capacity,
                errors=len(self.errors),
            )
        )

    def _outcome(self, end: End, detail: str) -> Outcome:
        options = self.options.options
        return Outcome(
            end=end,
            detail=detail,
            lines=len(self.lines),
            sent=self.streamer.sent,
            answered=self.streamer.answered,
            last_answered=self.streamer.last_answered,
            last_accepted=self._last_accepted,
            refused=self._refused,
            unanswered=tuple(self.streamer.under_way),
            errors=tuple(self.errors),
            elapsed_s=self.client.clock() - self._begin,
            snapshot=self.client.now(),
            planner_blocks=options.planner_blocks if options else 0,
            messages=tuple(self.messages),
            running=next((line for line in self.lines if line.number == self._running), None)
            if self._running
            else None,
        )


def _check_lengths(lines: Sequence[JobLine], capacity: int) -> None:
    for line in lines:
        if len(line.wire) > capacity:
            raise JobError(
                f"line {line.number} has {len(line.wire)} characters without comments; the controller takes {capacity}"
            )
