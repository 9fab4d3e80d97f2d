"""What people read about the boards: a page of each on the site, and the rules in boards/README.md."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from wificnc.board.abilities import ability_rows
from wificnc.board.labels import PinRow, notes, pin_rows, spare_drivers_text
from wificnc.board.model import Board
from wificnc.board.problem import RULES
from wificnc.board.rules import ALLOWABLE, pulse_rate_hz
from wificnc.board.shift_registers import words_text

from generate.board_start import picture_text, start_text
from generate.files import with_region
from generate.markdown import table_text

README = "boards/README.md"


def readme_texts(root: Path) -> dict[str, str]:
    """Path -> text. Raises ValueError for a file without its region."""
    rules = table_text(["rule", "holds when", "allow"], _rules()) + "\n"
    return {README: with_region((root / README).read_text(encoding="utf-8"), "rules", rules)}


def board_page(board: Board) -> str:
    """docs/boards/ID.md of the site; its picture lies next to it."""
    firmware = board.pins.firmware
    start = start_text(board, firmware.page) if firmware and firmware.page else _head(board)
    pins = pin_rows(board)
    blocks = [
        start + "\n## Every pin",
        "\n".join(_facts(board)),
        _pin_table(pins),
        *_allowed(pins),
        *_deviations(board),
    ]
    return "\n\n".join(blocks) + "\n"


def _head(board: Board) -> str:
    """Of a board without a chip."""
    blocks = [f"# {board.name}", f"`{board.id}`: {board.summary}.", *_notes(board), picture_text(board)]
    return "\n\n".join(blocks) + "\n"


def overview_table(boards: Iterable[Board]) -> str:
    """For docs/boards.md of the site."""
    rows = [
        [
            f"[{board.id}](boards/{board.id}.md)",
            board.name,
            board.summary,
            board.axes_text,
            f"{board.timing.max_step_rate_hz // 1000} kHz",
            "W5500" if board.ethernet else "",
        ]
        for board in boards
    ]
    return table_text(["board", "name", "what for", "axes", "steps/s", "Ethernet"], rows)


def ability_table(boards: Sequence[Board]) -> str:
    """For docs/boards.md of the site."""
    return table_text(["", "codes", *(board.id for board in boards), "without it"], ability_rows(boards))


def _rules() -> Iterator[list[str]]:
    for rule, holds in RULES.items():
        yield [f"`{rule}`", holds, "with a reason" if rule in ALLOWABLE else ""]


def _facts(board: Board) -> Iterator[str]:
    timing, memory = board.timing, board.memory
    yield f"- Chip: {board.pins.name} ({board.pins.datasheet}); memory: {board.pins.memory[memory.mode]}"
    if memory.flash_mb:
        yield f"- Flash: {_sizes(memory.flash_mb)}; PSRAM: {_sizes(memory.psram_mb)}"
    yield (
        f"- Steps: up to {timing.max_step_rate_hz // 1000} kHz, pulse {timing.step_pulse_ns} ns{_starts(board)}, "
        f"direction {timing.dir_setup_ns} ns before it, timer tick {1e9 / timing.timer_hz:g} ns"
    )
    if words := words_text(board):
        yield f"- {words[0].upper()}{words[1:]}"
    if spare := spare_drivers_text(board):
        yield f"- {spare[0].upper()}{spare[1:]}"
    if board.look_ahead:
        yield f"- Look-ahead: {board.look_ahead} pieces of path, {board.laser_marks} changes of a laser's S"
    yield f"- Published map: {board.source.map}"
    url = f" (<{board.source.url}>)" if board.source.url else ""
    yield f"- Board: {board.source.board}{url}"


def _starts(board: Board) -> str:
    """With the $0 of a new board, where that is not the board's shortest pulse."""
    us = board.timing.default_pulse_us
    return f" ($0 starts at {us} us, which leaves {pulse_rate_hz(board):,} steps/s)" if us else ""


def _sizes(sizes_mb: Sequence[int]) -> str:
    return " or ".join(f"{size} MB" if size else "none" for size in sizes_mb) or "none"


def _notes(board: Board) -> Iterator[str]:
    lines = notes(board)
    if lines:
        yield "Before wiring:"
        yield "\n".join(f"- {line}" for line in lines)


def _pin_table(rows: Sequence[PinRow]) -> str:
    cells = [[row.label, f"`{row.pin}`", row.direction, row.active, row.pull, ", ".join(row.remarks)] for row in rows]
    return table_text(["signal", "pin", "", "active", "pull", "the pin is also"], cells)


def _allowed(rows: Sequence[PinRow]) -> Iterator[str]:
    cells = [[f"`{row.pin}`", row.label, rule, reason] for row in rows for rule, reason in row.allow.items()]
    if cells:
        yield "Accepted risks, and why they are safe here:"
        yield table_text(["pin", "signal", "rule", "why it is safe"], cells)


def _deviations(board: Board) -> Iterator[str]:
    yield "Deviations from the published map:"
    if not board.deviation:
        yield "None."
        return
    cells = [
        [f"`{deviation.key}`", deviation.published, board.value_of(deviation.key), deviation.why]
        for deviation in board.deviation
    ]
    yield table_text(["key", "published", "here", "why"], cells)
