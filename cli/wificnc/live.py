"""A running job on a terminal: one bar, one line of figures, one line of keys. Draws; decides nothing."""

from __future__ import annotations

import sys
from types import TracebackType

from rich.console import Group, RenderableType
from rich.live import Live
from rich.markup import escape
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from wificnc import ui
from wificnc.connection.client import Snapshot
from wificnc.job.run import LineError, Phase, Progress

KEYS = "! hold   ~ resume   + - 0 feed   x reset   q quit"
AXES = "XYZABC"
STATE_STYLES = {
    "Run": "green",
    "Idle": "cyan",
    "Hold": "yellow",
    "Tool": "yellow",
    "Door": "yellow",
    "Alarm": "bold red",
}


class JobDisplay:
    """Watches a job. On a terminal it draws; elsewhere it only says what must be said."""

    def __init__(self, file: str) -> None:
        self.file = file
        self._live = Live(console=ui.talk, auto_refresh=False, transient=True) if sys.stderr.isatty() else None
        self._question = ""

    def __enter__(self) -> JobDisplay:
        if self._live:
            self._live.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, value: BaseException | None, tb: TracebackType | None) -> None:
        if self._live:
            self._live.stop()

    def progress(self, progress: Progress) -> None:
        if self._live:
            self._live.update(panel(self.file, progress), refresh=True)
        elif progress.question != self._question and progress.question:
            ui.note(progress.question)
        self._question = progress.question

    def error(self, error: LineError) -> None:
        ui.talk.print(f"[bold red]{escape(error.title(self.file))}[/]", soft_wrap=True)
        ui.talk.print(f"    {escape(error.line.text)}", soft_wrap=True)

    def message(self, text: str) -> None:
        ui.note(text)


def panel(file: str, progress: Progress) -> RenderableType:
    """The three lines."""
    bar = Table.grid(padding=(0, 1))
    bar.add_row(
        Text(file, style="bold"),
        ProgressBar(total=1.0, completed=progress.share, width=30),
        f"{100 * progress.share:5.1f} %",
        f"line {progress.line:,}",
        f"{clock(progress.elapsed_s)} elapsed",
        f"{clock(progress.remaining_s)} left" if progress.remaining_s is not None else "",
    )
    last = (
        Text.assemble((progress.question, "bold yellow"))
        if progress.question
        else Text(KEYS if progress.phase is Phase.RUNNING else f"{progress.phase.value} …", style="dim")
    )
    return Group(bar, figures(progress), last)


def figures(progress: Progress) -> Text:
    """Run  X 12.000 Y 3.500 Z -1.000  F 800  S 12000  100 %  buffer 812/1024"""
    snapshot = progress.snapshot
    state = snapshot.status.state
    parts = [
        (f"{snapshot.state:<6}", STATE_STYLES.get(state, "")),
        ("  " + place(moving(snapshot.wpos)), ""),
        (f"  F {snapshot.status.feed or 0:.0f}  S {snapshot.status.speed or 0:.0f}", ""),
    ]
    if snapshot.overrides:
        parts.append((f"  feed {snapshot.overrides[0]} %", "" if snapshot.overrides[0] == 100 else "yellow"))
    parts.append((f"  buffer {progress.under_way}/{progress.rx_bytes}", "dim"))
    if progress.errors:
        parts.append((f"  {progress.errors} error{'s' * (progress.errors != 1)}", "bold red"))
    return Text.assemble(*parts)


def moving(position: tuple[float, ...]) -> tuple[float, ...]:
    """Without the turning axes while the last of them stand at 0: the line is short."""
    while len(position) > 3 and position[-1] == 0:
        position = position[:-1]
    return position


def place(position: tuple[float, ...]) -> str:
    """X 12.000  Y 3.500  Z -1.000"""
    return "  ".join(f"{axis} {value:.3f}" for axis, value in zip(AXES, position, strict=False))


def clock(seconds: float) -> str:
    """0:07, 12:03, 1:02:03"""
    minutes, second = divmod(round(seconds), 60)
    hours, minute = divmod(minutes, 60)
    return f"{hours}:{minute:02d}:{second:02d}" if hours else f"{minute}:{second:02d}"


def final_position(snapshot: Snapshot) -> str:
    return f"{place(snapshot.wpos)}  (machine {place(snapshot.mpos)})"
