"""`wificnc expand FILE`: the plain lines that a program executes."""

from __future__ import annotations

from pathlib import Path

import rich_click as click

from wificnc import ui
from wificnc.board.load import load_board
from wificnc.build.host import ensure_host_library
from wificnc.commands._output import OutputFile
from wificnc.commands._program import max_lines_option
from wificnc.errors import JobError
from wificnc.job.expand import Expanded, Start, expand, load_expand
from wificnc.job.program import (
    LONGEST_CODE,
    expanded_lines,
    faults_text,
    printable,
    read_program,
    split_lines,
)
from wificnc.job.refusal import refusal_hint
from wificnc.output import STDOUT, write_output
from wificnc.simulator.job import read_job
from wificnc.simulator.library import load_library
from wificnc.simulator.refused import refused_lines
from wificnc.simulator.run import board_timing


@click.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.option("-o", "--output", type=OutputFile(), required=True, metavar="OUT",
              help="Write the lines here; - is stdout.")  # fmt: skip
@click.option("--at-zero", is_flag=True,
              help="The machine is assumed to be at 0, without offsets, in the modes after power-on.")  # fmt: skip
@click.option("--number", is_flag=True, help="Give each line the number of its line in FILE as N word.")
@max_lines_option
def command(file: Path, output: Path, at_zero: bool, number: bool, max_lines: int) -> None:
    """Run the O words, expressions and parameters of a program FILE, and write the plain lines that are left.

    Any Grbl controller understands them. A program that depends on the machine's position, its offsets or a probe is
    refused, and so are the lines that `wificnc check` refuses.
    """
    start = Start.AT_ZERO if at_zero else Start.ANYWHERE
    library = load_expand(ensure_host_library())
    data = read_job(file)
    read_program(file.name, data)  # refuses what `wificnc send` refuses
    expanded = expand(library, file.name, data, start, max_lines)
    _refuse(file.name, data, expanded)
    text = commented_text(file.name, data, expanded, number)
    write_output("--output", output, text)
    if words := expanded.ending.words:
        ui.warn(f"{file.name}: {words}", expanded.ending.hint)
    if output != STDOUT:
        ui.note(f"wrote {output}: {len(expanded.numbers):,} lines")


def _refuse(name: str, data: bytes, expanded: Expanded) -> None:
    """Raises JobError: lines that the controller does not take."""
    library, timing = load_library(ensure_host_library()), board_timing(load_board("host"))
    raw, found = split_lines(data), dict[str, str]()
    for refused in refused_lines(library, timing, expanded.text.decode("ascii").splitlines()):
        number = expanded.numbers[refused.index]
        line = f"{name}:{number}: error:{refused.code} {refused.message}: {printable(raw[number - 1]).strip()}"
        found.setdefault(line, refusal_hint(refused.code))
    if found:
        raise JobError(faults_text([*found]), hint=next(iter(found.values())))


def commented_text(name: str, data: bytes, expanded: Expanded, numbered: bool) -> bytes:
    """The lines with the comments that a controller keeps or shows, and, if asked for, with N words, but for those that
    have one or are $ lines. A line that would become too long goes without one of these. Raises JobError."""
    return b"".join(
        _written(number if numbered and line[:1] not in (b"N", b"$") else 0, line, comment) + b"\n"
        for number, line, comment in expanded_lines(name, data, expanded)
    )


def _written(number: int, line: bytes, comment: bytes) -> bytes:
    name = b"N%d" % number if number else b""
    choices = [name + line + comment, line + comment, name + line]
    return next((each for each in choices if len(each) <= LONGEST_CODE), line)
