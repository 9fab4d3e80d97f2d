"""`wificnc settings get | set | export | import | diff`."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import rich_click as click
from rich.markup import escape
from rich.table import Table

from wificnc import ui
from wificnc.commands._output import OutputFile
from wificnc.commands._target import controller_option, json_option
from wificnc.commands._together import refuse_given
from wificnc.connection.client import Client, Target, connected, error_words, expect_state
from wificnc.connection.settings import (
    Change,
    Values,
    assignment,
    differences,
    export_text,
    find,
    has_dollar_lines,
    known,
    name_of,
    out_of_range,
    read_dollar_lines,
    read_file,
    sending_order,
)
from wificnc.connection.target import is_target
from wificnc.errors import Exit, JobError, RefusedError, UserError
from wificnc.files.bounded import SMALL_MAX, read_text
from wificnc.files.tomlfile import read_toml
from wificnc.output import STDOUT, write_output
from wificnc.profile.load import load_machine

CONTROLLER = "controller"
WIDE = 140  # columns of a terminal that has room for what a setting does


@click.group()
def command() -> None:
    """Read, change, export, import and compare the settings of a controller."""


@command.command()
@click.argument("names", nargs=-1)
@controller_option
@json_option
def get(names: tuple[str, ...], target: Target, as_json: bool) -> None:
    """Show all settings, or those of these NAMES: `max_rate_mm_min.x`, `$110`."""
    wanted = [find(name) for name in names]
    values = read_controller(target)
    for number in wanted:
        if number not in values:
            raise RefusedError(f"the controller has no {name_of(number)}")
    shown = {number: values[number] for number in wanted or values}
    if as_json:
        ui.emit_json({name_of(number): json_value(number, text) for number, text in shown.items()})
    elif len(wanted) == 1:
        ui.data.print(shown[wanted[0]], markup=False)
    else:
        ui.data.print(settings_table(shown))


@command.command(context_settings={"ignore_unknown_options": True})
@click.argument("assignments", nargs=-1, required=True, metavar="NAME=VALUE...")
@controller_option
@json_option
def set(assignments: tuple[str, ...], target: Target, as_json: bool) -> None:
    """Change settings: `wificnc settings set max_rate_mm_min.x=5000 '$22=1'`."""
    wanted: Values = {}
    for text in assignments:
        number, value = assignment(text)
        wanted[number] = value
    with ready(target) as client:
        before = client.settings()
        apply(client, sending_order([Change(n, name_of(n), "", before.get(n), value) for n, value in wanted.items()]))
        changes = differences(before, client.settings())
    show_changes(changes)
    ui.note(f"{len(changes)} changed" if changes else "no setting was changed")
    if as_json:
        ui.emit_json([change_json(change) for change in changes])


@command.command()
@click.argument("file", type=OutputFile(), default=STDOUT)
@controller_option
@json_option
@click.pass_context
def export(ctx: click.Context, file: Path, target: Target, as_json: bool) -> None:
    """Write all settings as TOML, with names, units and descriptions, to FILE or stdout (-)."""
    if file != STDOUT:
        refuse_given(ctx, ("as_json",), "prints to stdout, and FILE would not be written", hint="leave one of them out")
    values = read_controller(target)
    if as_json:
        ui.emit_json({name_of(number): json_value(number, text) for number, text in values.items()})
        return
    text = export_text(values, target.url)
    write_output("FILE", file, text.encode())
    if file != STDOUT:
        ui.note(f"wrote {file}: {len(values)} settings")


@command.command(name="import")
@click.argument("file")
@controller_option
@click.option("-y", "--yes", is_flag=True, help="Without asking.")
@json_option
def import_(file: str, target: Target, yes: bool, as_json: bool) -> None:
    """Write the settings of FILE to the controller. Shows the changes and asks for confirmation.

    FILE is one that `export` wrote, what `$$` printed on any Grbl controller, a machine profile, or the name of a
    profile that comes with WiFiCNC, such as shapeoko3. Settings that FILE does not have stay as they are.
    """
    wanted = read_values(file)
    with ready(target) as client:
        before = client.settings()
        if missing := sorted(number for number in wanted if number not in before):
            ui.warn(f"the controller does not have {', '.join(name_of(number) for number in missing)}: skipped")
        after = {**before, **{number: text for number, text in wanted.items() if number in before}}
        changes = differences(before, after)
        show_changes(changes)
        if refused := out_of_range(changes):
            raise UserError("\n".join([f"nothing was changed, because of {file}:", *refused]))
        if changes:
            agree(len(changes), yes)
            apply(client, sending_order(changes))
        if changes and (left := differences(client.settings(), after)):
            raise JobError(f"the controller did not accept {', '.join(change.name for change in left)}")
    ui.note(f"{len(changes)} changed" if changes else "nothing to change")
    if as_json:
        ui.emit_json([change_json(change) for change in changes])


@command.command()
@click.argument("before")
@click.argument("after", default=CONTROLLER)
@click.option("--to", "target", envvar="WIFICNC_TO", show_envvar=True, metavar="TARGET", help="Which controller.")
@json_option
@click.pass_context
def diff(ctx: click.Context, before: str, after: str, target: str | None, as_json: bool) -> None:
    """Compare two files or machine profiles, or one and the controller (`controller`, or its target).

    Exit code 1 if they differ, as with diff.
    """
    if CONTROLLER not in (before, after):
        refuse_given(ctx, ("target",), f"has no effect: neither side is `{CONTROLLER}`")
    changes = differences(read_side(before, target), read_side(after, target))
    if as_json:
        ui.emit_json([change_json(change) for change in changes])
    else:
        show_changes(changes, to_stdout=True)
    ctx.exit(Exit.JOB if changes else Exit.OK)


# ---- the controller ----


class ready:
    """A controller that takes settings now."""

    def __init__(self, target: Target) -> None:
        self._connected = connected(target)

    def __enter__(self) -> Client:
        client = self._connected.__enter__()
        try:
            expect_state(client, "Idle", "Alarm")
            client.synchronise()
        except BaseException:
            self._connected.__exit__(*sys.exc_info())
            raise
        return client

    def __exit__(self, *details: Any) -> None:
        self._connected.__exit__(*details)


def read_controller(target: Target) -> Values:
    with ready(target) as client:
        return client.settings()


def read_side(side: str, target: str | None) -> Values:
    """One side of a comparison."""
    if is_target(side) and not Path(side).is_file():
        return read_controller(Target(side))
    if side != CONTROLLER:
        return read_values(side)
    if target is None:
        raise UserError("which controller?", hint="--to TARGET, or set WIFICNC_TO")
    return read_controller(Target(target))


def read_values(file: str) -> Values:
    """Of an exported file, of what `$$` printed, or of a machine profile: that has a name."""
    path = Path(file)
    with suppress(OSError):  # read_toml() reports it
        text = read_text(path, SMALL_MAX, errors="replace")
        if has_dollar_lines(text):
            return read_dollar_lines(path, text)
    is_profile = "name" in read_toml(path).data if path.is_file() else not path.suffix and path.name == file
    return load_machine(file).settings_texts() if is_profile else read_file(path)


def apply(client: Client, changes: Sequence[Change]) -> None:
    """Send them one by one. Raises RefusedError at the first that is refused."""
    for done, change in enumerate(changes):
        answer = client.command(f"${change.number}={change.after}")
        if answer.code:
            already = f" ({done} before it were applied)" if done else ""
            raise RefusedError(f"{change.name} = {change.after}: {error_words(answer.code)}{already}")


def agree(count: int, yes: bool) -> None:
    if yes:
        return
    if not sys.stdin.isatty():
        raise UserError("an import needs confirmation, and this is not a terminal", hint="--yes in scripts")
    if not click.confirm(f"Change {count} setting{'s' * (count != 1)}?", err=True):
        raise JobError("nothing was changed")


# ---- words ----


def json_value(number: int, text: str) -> bool | int | float | str:
    entry = known(number)
    if entry is None:
        return text
    if entry.row.type == "bool":
        return text != "0"
    return float(text) if entry.row.type == "float" else int(text)


def change_json(change: Change) -> dict[str, Any]:
    return {
        "name": change.name,
        "number": change.number,
        "before": None if change.before is None else json_value(change.number, change.before),
        "after": None if change.after is None else json_value(change.number, change.after),
    }


def settings_table(values: Values) -> Table:
    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0), header_style="dim")
    columns = ("$", "name", "value", "unit", "what it does")[: 5 if ui.data.width >= WIDE else 4]
    for column in columns:
        table.add_column(column, justify="right" if column == "value" else "left", no_wrap=True)
    for number, text in sorted(values.items()):
        entry = known(number)
        words = (escape(entry.row.unit), escape(entry.row.help)) if entry else ("", "")
        table.add_row(*(f"${number}", name_of(number), text, *words)[: len(columns)])
    return table


def show_changes(changes: Sequence[Change], to_stdout: bool = False) -> None:
    """name: before -> after unit, a line each."""
    console = ui.data if to_stdout else ui.talk
    for change in changes:
        before, after = ("-" if text is None else text for text in (change.before, change.after))
        console.print(
            f"[bold]{change.name}[/] (${change.number}): [red]{before}[/] -> [green]{after}[/] {escape(change.unit)}",
            soft_wrap=True,
        )
