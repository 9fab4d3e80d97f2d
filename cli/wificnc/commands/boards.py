"""`wificnc boards`: list, show, check and import boards."""

from __future__ import annotations

from pathlib import Path
from textwrap import wrap
from typing import Any

import rich_click as click
from rich.markup import escape
from rich.table import Column, Table

from wificnc import ui
from wificnc.board.abilities import lack_lines, lacks
from wificnc.board.fluidnc.convert import Imported, import_fluidnc
from wificnc.board.fluidnc.remarks import Kind
from wificnc.board.labels import PinRow, notes, pin_rows, spare_drivers_text
from wificnc.board.load import check_board, find_boards, load_board
from wificnc.board.model import Board
from wificnc.board.picture import ROLE_COLOURS, save_picture
from wificnc.board.rules import pulse_rate_hz
from wificnc.board.shift_registers import words_text
from wificnc.commands._output import OutputFile
from wificnc.commands._target import json_option
from wificnc.errors import Exit, UserError
from wificnc.files.problem import Problem
from wificnc.output import write_output
from wificnc.profile import check_machine

COLUMNS = ("board", "axes", "steps/s", "network")  # in one line, so that an id can be copied
WIDE_LIST = 110  # characters of a terminal that leave enough for a column of what boards are for


@click.group()
def command() -> None:
    """List, show, check and import boards. BOARD is a board's id or the path of its TOML file."""


@command.command("list")
@json_option
def list_boards(as_json: bool) -> None:
    """List the boards."""
    boards = [load_board(path) for path in find_boards()]
    if as_json:
        ui.emit_json([_summary(board) for board in boards])
        return
    if ui.data.width >= WIDE_LIST:
        table = Table(*(Column(name, no_wrap=True) for name in COLUMNS), "what for", box=None, pad_edge=False)
        for board in boards:
            table.add_row(*_columns(board), escape(board.summary))
        ui.data.print(table)
        return
    rows = [COLUMNS, *map(_columns, boards)]
    widths = [max(map(len, cells)) for cells in zip(*rows, strict=True)]
    for row, summary in zip(rows, ("what for", *(board.summary for board in boards)), strict=True):
        ui.data.print("  ".join(map(str.ljust, row, widths)).rstrip(), style="bold")
        for line in wrap(summary, ui.data.width, initial_indent="    ", subsequent_indent="    "):
            ui.data.print(escape(line))


def _columns(board: Board) -> tuple[str, ...]:
    rate = f"{board.timing.max_step_rate_hz // 1000} k"
    return board.id, board.axes_text, rate, " + ".join(_networks(board))


@command.command("show")
@click.argument("board_ref", metavar="BOARD")
@json_option
@click.option("--picture", type=OutputFile(stdout=False), help="Draw the pin-out as .svg or .png.")
def show_board(board_ref: str, as_json: bool, picture: Path | None) -> None:
    """Show the wiring of a board."""
    board = load_board(board_ref)
    if picture:
        save_picture("--picture", board, picture)
        ui.note(f"wrote {picture}")
    if as_json:
        ui.emit_json(_details(board))
    else:
        _print_board(board)


@command.command("check")
@click.argument("board_refs", metavar="[BOARD|FILE]...", nargs=-1)
@json_option
@click.pass_context
def check_boards(ctx: click.Context, board_refs: tuple[str, ...], as_json: bool) -> None:
    """Check boards, all of them by default. Exit code 3 if there is a problem."""
    refs: list[str | Path] = [*board_refs] or [*find_boards()]
    problems = [problem for ref in refs for problem in check_board(ref)]
    if as_json:
        ui.emit_json([problem.as_json() for problem in problems])
    else:
        for problem in problems:
            _print_problem(problem)
        files = len({problem.file for problem in problems})
        counted = f"{len(problems)} problem{'s' * (len(problems) != 1)} in {files} of {_count(refs)}"
        ui.data.print(f"[bold red]{counted}[/]" if problems else f"[bold green]{_count(refs)} without a problem[/]")
    ctx.exit(Exit.BOARD if problems else Exit.OK)


@command.command("import")
@click.argument("config", metavar="FLUIDNC.yaml", type=click.Path(path_type=Path, dir_okay=False, exists=True))
@click.option("-o", "--output", type=OutputFile(stdout=False), help="The board file; the name of the configuration.")
@click.option("--machine", type=OutputFile(stdout=False), help="The machine profile; the same with -machine.")
@click.option("--chip", type=click.Choice(("esp32", "esp32s3")), help="The chip, where its pins do not say it.")
@json_option
@click.pass_context
def import_board(
    ctx: click.Context, config: Path, output: Path | None, machine: Path | None, chip: str | None, as_json: bool
) -> None:
    """Convert a FluidNC configuration into a board file and a machine profile, and list what was not taken.

    Exit code 3 if the rules of boards refuse a pin of it; both files are written all the same, to be edited.
    """
    board_file, machine_file = output or _new_file(config, ""), machine or _new_file(config, "-machine")
    imported = import_fluidnc(config, chip)
    _write_both(board_file, imported.board_text(config.name), machine_file, imported.machine_text(config.name))
    problems = [*check_board(board_file), *check_machine(machine_file)]
    if as_json:
        remarks = [remark.as_json() for kind in Kind for remark in imported.remarks.of(kind)]
        shown = [problem.as_json() for problem in problems]
        files = {"board": str(board_file), "machine": str(machine_file), "store": imported.stored}
        ui.emit_json({**files, "remarks": remarks, "problems": shown})
    else:
        _print_imported(imported, board_file, machine_file, problems)
    ctx.exit(Exit.BOARD if problems else Exit.OK)


def _new_file(config: Path, ending: str) -> Path:
    """In the working directory. Raises UserError when it is there: it may have been edited since."""
    path = Path(f"{config.stem}{ending}.toml")
    if path.exists():
        raise UserError(f"{path} exists", hint="-o FILE and --machine FILE name the files; these may exist")
    return path


def _write_both(board: Path, board_text: str, machine: Path, machine_text: str) -> None:
    """Both, or neither. Raises UserError."""
    before = board.read_bytes() if board.exists() else None
    write_output("--output", board, board_text.encode())
    try:
        write_output("--machine", machine, machine_text.encode())
    except UserError:
        if before is None:
            board.unlink()
        else:
            board.write_bytes(before)
        raise


def _print_imported(imported: Imported, board: Path, machine: Path, problems: list[Problem]) -> None:
    ui.note(f"wrote {board} and {machine}")
    for kind in Kind:
        _print_list(kind.value, imported.remarks.lines(kind))
    if problems:
        ui.data.print("\n[bold]refused: correct the files, then `wificnc boards check`[/]")
        for problem in problems:
            _print_problem(problem)
        return
    stored = "".join(f" --set {key}={value}" for key, value in imported.stored.items())
    build = f"wificnc nvs build {machine} --board {board}{stored}"
    _print_list("next", [f"wificnc boards show {board}", f"wificnc build {board}", build])


def _count(refs: list[str | Path]) -> str:
    return f"{len(refs)} board{'s' * (len(refs) != 1)}"


def _networks(board: Board) -> list[str]:
    wifi = ["Wi-Fi"] if board.target == "esp32" else []
    return [*wifi, "Ethernet"] if board.ethernet else wifi


def _summary(board: Board) -> dict[str, Any]:
    return {
        "id": board.id,
        "name": board.name,
        "summary": board.summary,
        "target": board.target,
        "chip": board.chip,
        "axes": list(board.axes),
        "second_motors": list(board.second_motors),
        "one_switch": list(board.one_switch),
        "timing": board.timing.model_dump(),
        "step_engine": board.step.engine,
        "memory": board.memory.model_dump(mode="json"),
        "network": _networks(board),
    }


def _details(board: Board) -> dict[str, Any]:
    return {
        **_summary(board),
        "notes": notes(board),
        "lacks": [{"what": row.name, "codes": row.codes, "answer": row.without} for row in lacks(board)],
        "pins": [
            {
                "signal": use.signal,
                "pin": use.pin,
                "number": board.pins.pin[use.pin].number,
                "direction": "out" if use.is_output else "in",
                "active": use.active,
                "pull": use.pull,
                "allow": use.wire.allow,
            }
            for use in board.uses()
        ],
        "deviations": [
            {**deviation.model_dump(), "here": board.value_of(deviation.key)} for deviation in board.deviation
        ],
    }


def _print_board(board: Board) -> None:
    timing = board.timing
    chip = f"{board.pins.name}, {board.pins.memory[board.memory.mode]}"
    pulse = f"pulse {timing.step_pulse_ns} ns, direction {timing.dir_setup_ns} ns before it"
    if us := timing.default_pulse_us:
        pulse += f"; $0 starts at {us} us, which leaves {pulse_rate_hz(board):,} steps/s"
    ui.data.print(f"[bold]{escape(board.name)}[/]  ({board.id})")
    ui.data.print(f"{escape(board.summary)}.", escape(chip), sep="\n")
    ui.data.print(f"axes {board.axes_text}, up to {timing.max_step_rate_hz // 1000} k steps/s, {pulse}")
    if words := words_text(board):
        ui.data.print(words)
    if spare := spare_drivers_text(board):
        ui.data.print(spare)
    if board.look_ahead:
        ui.data.print(f"look-ahead {board.look_ahead} pieces of path, {board.laser_marks} changes of a laser's S")
    ui.data.print()
    ui.data.print(_pin_table(board))
    risks = [(row, rule, reason) for row in pin_rows(board) for rule, reason in row.allow.items()]
    _print_list("risks taken", [f"{row.pin} {row.label}, {rule}: {reason}" for row, rule, reason in risks])
    published = "published {0.published}, here {1}: {0.why}"
    deviations = [(item, board.value_of(item.key)) for item in board.deviation]
    _print_list("deviations", [f"{item.key}: {published.format(item, here)}" for item, here in deviations])
    _print_list("not on this board, and the answer to it", lack_lines(board))
    _print_list("before wiring", notes(board))


def _pin_table(board: Board) -> Table:
    table = Table("signal", "pin", "", "active", "pull", "the pin is also", box=None, pad_edge=False)
    for row, use in zip(pin_rows(board), board.uses(), strict=True):
        table.add_row(f"[{ROLE_COLOURS[use.role]}]■[/] {row.label}", *_cells(row))
    return table


def _cells(row: PinRow) -> list[str]:
    return [f"[bold]{row.pin}[/]", row.direction, row.active, row.pull, ", ".join(row.remarks)]


def _print_list(title: str, lines: list[str]) -> None:
    if lines:
        ui.data.print(f"\n[bold]{title}[/]")
    for line in lines:
        ui.data.print(f"  {escape(line)}")


def _print_problem(problem: Problem) -> None:
    place, _, rest = str(problem).partition(": ")
    text, _, hint = rest.partition("\n  hint: ")
    ui.data.print(f"[bold]{escape(place)}:[/] {escape(text)}")
    if hint:
        ui.data.print(f"  [blue]hint:[/] {escape(hint)}")
