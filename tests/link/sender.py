"""A sender without a terminal: who presses its keys, who reads what it says, and the run of a text."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

from core_bridge import Bridge
from wificnc.connection.client import Client, connected
from wificnc.connection.grbl import Options
from wificnc.job.program import read_program
from wificnc.job.run import JobRun, LineError, Outcome, Progress, RunOptions


class Nobody:
    """Keys of a script: none. Or those of a person who is there from the start."""

    def __init__(self, interactive: bool = False) -> None:
        self.interactive = interactive
        self.pressed = ""

    def fds(self) -> Sequence[int]:
        return []

    def read(self) -> str:
        pressed, self.pressed = self.pressed, ""
        return pressed


class Notes:
    """A watcher that remembers; on_progress may press keys."""

    def __init__(self, on_progress: Callable[[Progress], None] | None = None) -> None:
        self.on_progress = on_progress
        self.seen: list[Progress] = []
        self.errors: list[LineError] = []
        self.messages: list[str] = []

    def progress(self, progress: Progress) -> None:
        self.seen.append(progress)
        if self.on_progress:
            self.on_progress(progress)

    def error(self, error: LineError) -> None:
        self.errors.append(error)

    def message(self, text: str) -> None:
        self.messages.append(text)


def run_job(client: Client, text: str, options: RunOptions | None = None, keys: Nobody | None = None,
            notes: Notes | None = None) -> Outcome:  # fmt: skip
    lines = read_program("job.nc", text.encode()).lines
    return JobRun(client, lines, notes or Notes(), keys or Nobody(), options or RunOptions()).run()


def advertised(rx_bytes: int) -> RunOptions:
    return RunOptions(Options("V", 15, rx_bytes))


@contextmanager
def talk(controller: Bridge) -> Iterator[Client]:
    """A client that is synchronised; the bridge counts from here."""
    with connected(controller.target) as client:
        client.synchronise()
        controller.begin_count()
        yield client
