"""What people read about the boards: docs/boards.md and boards/README.md, written from the board files."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from wificnc.board.abilities import ability_rows
from wificnc.board.labels import PinRow, notes, pin_rows
from wificnc.board.model import Board
from wificnc.board.problem import RULES
from wificnc.board.rules import ALLOWABLE, pulse_rate_hz

GENERATED = "<!-- Written by `python -m wificnc.board.generate` from the board files. Do not edit. -->"
_PICTURES = "pinout"


def docs_text(boards: Sequence[Board]) -> str:
    """docs/boards.md: every board with its picture, pins, risks and deviations."""
    parts = [_INTRO.format(generated=GENERATED, table=_overview(boards, link="#{id}"), abilities=_abilities(boards))]
    parts += [_board_section(board) for board in boards]
    return "\n".join(parts)


def readme_text(boards: Sequence[Board]) -> str:
    """boards/README.md: the list, and how to add one."""
    table = _overview(boards, link="../docs/boards.md#{id}")
    rules = table_text(["rule", "holds when", "allow"], _rules())
    return _README.format(generated=GENERATED, table=table, rules=rules)


def _rules() -> Iterator[list[str]]:
    for rule, holds in RULES.items():
        yield [f"`{rule}`", holds, "with a reason" if rule in ALLOWABLE else ""]


def _overview(boards: Iterable[Board], link: str) -> str:
    rows = [
        [
            f"[{board.id}]({link.format(id=board.id)})",
            board.name,
            "".join(board.axes),
            f"{board.timing.max_step_rate_hz // 1000} kHz",
            "W5500" if board.ethernet else "",
            board.summary,
        ]
        for board in boards
    ]
    return table_text(["board", "name", "axes", "steps/s", "Ethernet", "what for"], rows)


def _abilities(boards: Sequence[Board]) -> str:
    return table_text(["", "codes", *(board.id for board in boards), "without it"], ability_rows(boards))


def table_text(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A Markdown table; a bar inside a cell is escaped."""
    lines = [list(head), ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |" for line in lines)


def _board_section(board: Board) -> str:
    blocks = [
        f'<a id="{board.id}"></a>\n\n## {board.name}',
        f"`{board.id}`: {board.summary}.",
        f"![Pin-out of {board.name}](../boards/{_PICTURES}/{board.id}.svg)",
        "\n".join(_facts(board)),
        *_notes(board),
        _pin_table(pin_rows(board)),
        *_allowed(pin_rows(board)),
        *_deviations(board),
    ]
    return "\n\n".join(blocks) + "\n"


def _facts(board: Board) -> Iterator[str]:
    timing, memory = board.timing, board.memory
    yield f"- Chip: {board.pins.name} ({board.pins.datasheet}); memory: {board.pins.memory[memory.mode]}"
    if memory.flash_mb:
        yield f"- Flash: {_sizes(memory.flash_mb)}; PSRAM: {_sizes(memory.psram_mb)}"
    yield (
        f"- Steps: up to {timing.max_step_rate_hz // 1000} kHz, pulse {timing.step_pulse_ns} ns{_starts(board)}, "
        f"direction {timing.dir_setup_ns} ns before it, timer tick {1e9 / timing.timer_hz:g} ns"
    )
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


_INTRO = """{generated}

# Boards

Wiring of each board, other functions of its pins, accepted risks, and differences from the published pin map.
On the command line: `wificnc boards list`, `wificnc boards show BOARD`, `wificnc boards show BOARD --picture
OUT.svg`. To add a board: [boards/README.md](../boards/README.md).

{table}

## Outputs and inputs of each board

A code or a setting that needs a pin which the board does not have is refused, and nothing changes. M5 and M9 are always
possible. CAM programs with M7 or M8 run on a board without coolant outputs after `$91=1`: the controller prints a
message once in a job, and nothing is switched.

{abilities}
"""

_README = """{generated}

# boards/

One TOML file per board: what it wires. The capabilities of a chip's pins are in `targets/*/pins*.toml`, and nowhere
else.

{table}

## Add your own board

1. Copy the nearest file; its name without `.toml` is the board's id. Editors that know `#:schema` complete the keys.
2. Write a pin as the chip's table names it: `step = "GPIO1"`, or with more to say
   `estop = {{ pin = "GPIO13", pull = "up", active = "low" }}`.
3. `wificnc boards check FILE` lists every problem with its line, the reason and the pins that would be legal.
4. A risk that your wiring excludes is allowed with a reason: `allow = {{ strapping = "why it is safe" }}`. The
   table says which rules can be. An allow that suppresses nothing is an error.
5. `wificnc boards show FILE --picture pinout.svg` draws it; `wificnc pins FILE` writes the header the firmware is built
   with.
6. For a board that goes into this folder: `python -m wificnc.board.generate` rewrites this page, `docs/boards.md`, the
   pictures and the schema.

Every difference from a published map is a `[[deviation]]` with its reason; one that deviates from nothing is an error.

## The rules

{rules}
"""
