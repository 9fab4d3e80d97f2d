"""`wificnc check FILE [--machine M]`: what of a job this machine cannot do."""

from __future__ import annotations

from pathlib import Path

import rich_click as click
from rich.markup import escape
from rich.table import Table

from wificnc import ui
from wificnc.commands._program import max_lines_option, progress_bar
from wificnc.commands._target import json_option
from wificnc.errors import Exit
from wificnc.simulator.check.finding import Finding, Severity
from wificnc.simulator.check.report import EXTENT_COLUMNS, extent_rows, finding_line, report_json
from wificnc.simulator.check.run import CheckOptions, CheckReport, check_job
from wificnc.simulator.report import duration

SHOWN = {Severity.ERROR: 20, Severity.WARNING: 20, Severity.NOTE: 5}
COLOURS = {Severity.ERROR: "bold red", Severity.WARNING: "bold yellow", Severity.NOTE: "dim"}


@click.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--machine", help="Machine profile, name or TOML file: travel, feeds and time are checked, too.")
@click.option("--board", default="host", show_default=True, help="Board id or TOML file: its step rate is a limit.")
@click.option("--work-zero", metavar="X..Y..Z..", help="Where the job's zero lies in machine coordinates, mm.")
@click.option("--set", "settings", multiple=True, metavar="NAME=VALUE",
              help="A setting on top of that, such as max_rate_mm_min.x=5000 or '$110=5000'; repeatable.")  # fmt: skip
@click.option("--at", multiple=True, metavar="'TIME WHAT'", help="Machine event, like '0s surface -5'; repeatable.")
@click.option("--strict", is_flag=True, help="Exit code 1 for warnings, too.")
@json_option
@max_lines_option
@click.pass_context
def command(
    ctx: click.Context, file: Path, machine: str | None, board: str, work_zero: str | None, settings: tuple[str, ...],
    at: tuple[str, ...], strict: bool, as_json: bool, max_lines: int,
) -> None:  # fmt: skip
    """Check a G-code FILE before it runs: travel, arcs, feeds, step rates, and the time it takes.

    The whole job runs on the machine's own planner, in virtual time. Exit code 1 when something is wrong.
    """
    options = CheckOptions(file, machine, board, settings, work_zero, at, max_lines)
    with progress_bar(file.name) as on_progress:
        report = check_job(options, on_progress)
    if as_json:
        ui.emit_json(report_json(report))
    else:
        _print(report)
    bad = report.count(Severity.ERROR) or (strict and report.count(Severity.WARNING))
    ctx.exit(Exit.JOB if bad else Exit.OK)


def _print(report: CheckReport) -> None:
    result = report.result
    share = 100 * result.max_step_rate_hz / report.step_rate_limit_hz
    if report.machine is None:
        ui.data.print(f"[bold]{escape(result.file)}[/], board {escape(report.board)}")
        ui.data.print("[dim]no --machine: its travel, its feeds and the time are not checked[/]")
    else:
        ui.data.print(f"[bold]{escape(result.file)}[/] on {escape(report.machine)}, board {escape(report.board)}")
        ui.data.print(
            f"takes {duration(result.job_time_s)}; at most {result.max_step_rate_hz:,.0f} steps/s ({share:.0f} %)"
        )
    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0), header_style="dim")
    for column in EXTENT_COLUMNS:
        table.add_column(column, justify="left" if column in ("axis", EXTENT_COLUMNS[-1]) else "right", no_wrap=True)
    for row in extent_rows(report):
        table.add_row(*row)
    ui.data.print(table)
    for severity, most in SHOWN.items():
        _print_findings(result.file, [finding for finding in report.findings if finding.severity is severity], most)
    counts = [
        f"{report.count(severity)} {severity.value}{'s' * (report.count(severity) != 1)}" for severity in Severity
    ]
    colour = "red" if report.count(Severity.ERROR) else "yellow" if report.count(Severity.WARNING) else "green"
    ui.data.print(f"[bold {colour}]{', '.join(counts)}[/]")


def _print_findings(file: str, findings: list[Finding], most: int) -> None:
    for finding in findings[:most]:
        ui.data.print(f"[{COLOURS[finding.severity]}]{escape(finding_line(file, finding))}[/]")
        if finding.hint:
            ui.data.print(f"  [blue]hint:[/] {escape(finding.hint)}")
    if len(findings) > most:
        ui.data.print(f"  and {len(findings) - most} more like these")
