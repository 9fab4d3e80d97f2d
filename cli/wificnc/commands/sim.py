"""`wificnc sim FILE`: run a G-code job through the real core in virtual time."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import rich_click as click
from rich.markup import escape
from rich.table import Table

from wificnc import ui
from wificnc.board.load import load_board
from wificnc.commands._chip import chip_image, on_chip_option, require_chips
from wificnc.commands._finite import FiniteRange
from wificnc.commands._output import OutputFile
from wificnc.commands._program import max_lines_option, progress_bar
from wificnc.errors import Exit, UserError
from wificnc.output import STDOUT
from wificnc.profile import load_machine
from wificnc.simulator.job import SimResult
from wificnc.simulator.report import AXIS_COLUMNS, axis_rows, error_line, laser_warning, report_json, summary_rows
from wificnc.simulator.run import SimOptions, check_axes, parse_setting, simulate
from wificnc.tables import load_settings

if TYPE_CHECKING:
    from wificnc_chips import ChipResult

ERRORS_SHOWN = 20


@click.command()
@click.argument("file", type=click.Path(path_type=Path), required=False)
@click.option("--board", default="host", show_default=True, help="Board id or TOML file: axes, timer, pulse timing.")
@click.option("--machine", help="Machine profile, name or TOML file: steps/mm, rates, accelerations, travel.")
@click.option("--set", "settings", multiple=True, metavar="NAME=VALUE",
              help="A setting on top of that, such as max_rate_mm_min.x=5000 or '$110=5000'; repeatable.")  # fmt: skip
@click.option("--json", "json_path", type=OutputFile(), help="Write the figures; - is stdout.")
@click.option(
    "--plot", type=OutputFile(stdout=False), help="Draw the path, its speed, what a laser burns: .png or .svg."
)
@click.option("--laser-w", type=FiniteRange(0, min_open=True), help="Optical power, W: --plot shows J/mm.")
@click.option("--trace", type=OutputFile(stdout=False), help="Write every step event: .csv, .vcd or .npz.")
@click.option("--at", multiple=True, metavar="'TIME WHAT'", help="Machine event, like '2.5s limit x'; repeatable.")
@click.option("--keep-going", is_flag=True, help="Continue after an error, and list all errors.")
@on_chip_option("Run the real image of the board in the virtual chip, and compare: a PIC32MZ's or an ESP32's.")
@max_lines_option
@click.pass_context
def command(
    ctx: click.Context, file: Path | None, board: str, machine: str | None, settings: tuple[str, ...],
    json_path: Path | None, plot: Path | None, laser_w: float | None, trace: Path | None,
    at: tuple[str, ...], keep_going: bool, max_lines: int, on_chip: str | None,
) -> None:  # fmt: skip
    """Run a G-code FILE through the real core in virtual time.

    Measures the motion from the step edges: times, speeds, extent, step counts.
    """
    json_file = None if json_path == STDOUT else json_path
    if file is None and on_chip:  # sim --on-chip FILE
        file, on_chip = Path(on_chip), ""
    if file is None:
        raise click.MissingParameter(ctx=ctx, param=ctx.command.params[0])
    options = SimOptions(file, board, machine, settings, json_file, plot, laser_w, trace, keep_going, at, max_lines)
    if on_chip is not None:
        if json_path or plot or laser_w or keep_going:
            raise UserError("--on-chip can be combined with --machine, --set, --at and --trace only")
        ctx.exit(Exit.OK if _run_on_chip(options, chip_image(on_chip)) else Exit.JOB)
    with progress_bar(file.name) as on_progress:
        result = simulate(options, on_progress)
    if json_path is not None and json_file is None:
        ui.emit_json(report_json(result))
    else:
        _print_result(result, machine is not None)
    _print_remarks(result)
    for path in (json_file, plot, trace):
        if path:
            ui.note(f"wrote {path}")
    ctx.exit(Exit.JOB if result.errors else Exit.OK)


def _run_on_chip(options: SimOptions, image: Path | None) -> bool:
    """@param image  None: what was built. @return whether no line was refused and every step is the host's"""
    require_chips("--on-chip")
    from wificnc_chips import run_on_chip

    board = load_board(options.board)
    profile = load_machine(options.machine) if options.machine else None
    check_axes(board, profile)
    settings = [*(profile.settings_lines() if profile else ()), *map(parse_setting, options.settings)]
    with progress_bar(options.file.name) as on_progress:
        result = run_on_chip(board, options, settings, on_progress, image=image)
    ui.data.print(f"[bold]{escape(str(options.file))}[/] in the image of {board.id}")
    ui.data.print(f"lines       {result.lines:,}, {len(result.errors)} refused")
    ui.data.print(f"step events {result.events:,} in {result.seconds:.3f} s")
    ui.data.print(f"position    {', '.join(map(str, result.position_steps))} steps")
    same = result.first_difference is None
    ui.data.print(f"the host    {compared(result)}")
    for error in result.errors[:ERRORS_SHOWN]:
        ui.talk.print(f"[bold red]{escape(error)}[/]", soft_wrap=True)
    if options.trace:
        ui.note(f"wrote {options.trace}")
    return same and not result.errors


def compared(result: ChipResult) -> str:
    """What the chip's steps are compared with the host's."""
    if result.first_difference is None:
        when = "" if result.spread_us is None else f", their delays differ by up to {result.spread_us:,.2f} us"
        return f"the same steps{when}"
    where = ", on the same path" if result.same_path else ""
    return f"another one at event {result.first_difference:,}{where}"


def _print_result(result: SimResult, has_machine: bool) -> None:
    summary = Table(box=None, show_header=False, pad_edge=False, padding=(0, 2, 0, 0))
    summary.add_column(style="dim")
    summary.add_column()
    for name, value in summary_rows(result):
        summary.add_row(name, value)
    axes = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0), header_style="dim")
    for column in AXIS_COLUMNS:
        axes.add_column(column, justify="left" if column == "axis" else "right", no_wrap=True)
    for row in axis_rows(result):
        axes.add_row(*row)
    ui.data.print(f"[bold]{escape(result.file)}[/]")
    if not has_machine:
        mm_s2 = load_settings()["acceleration_mm_s2"].default
        ui.data.print(f"[dim]no --machine: Grbl's default settings, with {mm_s2:g} mm/s²[/]")
    ui.data.print(summary)
    ui.data.print(axes)


def _print_remarks(result: SimResult) -> None:
    for warning in result.warnings:
        ui.warn(warning)
    if warned := laser_warning(result):
        ui.warn(*warned)
    for error in result.errors[:ERRORS_SHOWN]:
        ui.talk.print(f"[bold red]{escape(error_line(result.file, error))}[/]", soft_wrap=True)
        if error.text:
            ui.talk.print(f"    {escape(error.text)}", soft_wrap=True)
    if len(result.errors) > ERRORS_SHOWN:
        ui.talk.print(f"and {len(result.errors) - ERRORS_SHOWN} more errors")
