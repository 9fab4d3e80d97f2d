"""`wificnc send FILE`: stream a job to a controller."""

from __future__ import annotations

import ctypes
import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import rich_click as click

from wificnc import ui
from wificnc.build.host import ensure_host_library
from wificnc.commands._finite import FINITE, FiniteRange
from wificnc.commands._program import max_lines_option
from wificnc.commands._target import controller_option, json_option, position_json
from wificnc.commands._together import refuse_given
from wificnc.connection.client import Client, Target, connected, expect_state, unit_mm
from wificnc.errors import BuildError, Exit, JobError, UserError
from wificnc.job.expand import Start, expand, load_expand, needs_expansion
from wificnc.job.fate import RESUMABLE, fate_lines, restart_words, wanted_line
from wificnc.job.program import JobLine, Program, expanded_program, longest_line, read_program, ready, words_of
from wificnc.job.rebuild import load_rebuild
from wificnc.job.resume import Approach, MachineFacts, Resume, modes_of, plan_resume
from wificnc.job.run import End, JobRun, Outcome, RunOptions
from wificnc.keyboard import Keyboard
from wificnc.live import JobDisplay, clock, final_position
from wificnc.simulator.estimate import Estimate
from wificnc.simulator.job import read_job
from wificnc.simulator.library import load_library

FOR_A_RESUME = ("start_id", "began", "safe_z", "spindle_wait", "plunge_feed", "yes")
MODES_OF_RESET = ("G54", "G17", "G21", "G90", "G91.1", "G94")
LINE_NUMBERS = "N"  # among the flags of [OPT:]
EXITS = {End.LINK_LOST: Exit.DEVICE, End.RESET: Exit.DEVICE, End.CONFUSED: Exit.PROTOCOL}


class ModesType(click.ParamType):  # type: ignore[type-arg, unused-ignore] # generic in newer releases alone
    """Words of $G, with or without blanks between them."""

    name = "modes"

    def convert(self, value: object, param: click.Parameter | None, ctx: click.Context | None) -> tuple[str, ...]:
        given = "".join(str(value).split()).upper()
        words = tuple(re.findall(r"[A-Z][^A-Z]*", given))
        if not words or "".join(words) != given or modes_of(words) != words:
            self.fail(f"{value!r} names no modes: write words of $G, as G55G20", param, ctx)
        return words


@dataclass(frozen=True)
class SendOptions:
    """The command line."""

    file: Path
    from_line: int | None
    start_id: str | None
    began: tuple[str, ...] | None
    approach: Approach
    yes: bool
    keep_going: bool
    dry_run: bool
    number: bool


@click.command()
@click.argument("file", type=click.Path(path_type=Path))
@controller_option
@click.option(
    "--from-line",
    type=click.IntRange(min=1),
    metavar="N",
    help="Resume at line N, with the modes of the lines before it.",
)
@click.option("--start-id", metavar="ID",
              help="Resume: of the first part's report; refuse if the controller has restarted since.")  # fmt: skip
@click.option("--began", type=ModesType(), metavar="MODES",
              help="Resume: the modes in which the job began, as G55G20, where the program does not set them. "
                   "Without it: those of the controller now.")  # fmt: skip
@click.option("--safe-z", type=FINITE, metavar="MM", help="Resume: height at which X and Y move, in work coordinates.")
@click.option("--spindle-wait", type=FiniteRange(min=0), default=4.0, show_default=True, metavar="S",
              help="Resume: time for the spindle to reach its speed, in seconds.")  # fmt: skip
@click.option("--plunge-feed", type=FiniteRange(min=0, min_open=True), default=200.0, show_default=True,
              metavar="MM/MIN", help="Resume: feed of the plunge.")  # fmt: skip
@click.option("-y", "--yes", is_flag=True, help="Resume without confirmation.")
@click.option("--keep-going", is_flag=True, help="Continue after a refused line; list all refused lines at the end.")
@click.option("--dry-run", is_flag=True, help="Check mode ($C): the controller reads every line and moves nothing.")
@click.option("--number/--no-number", default=True, show_default=True,
              help="Send N words, so that reports show the line being executed.")  # fmt: skip
@max_lines_option
@json_option
@click.pass_context
def command(
    ctx: click.Context, file: Path, target: Target, from_line: int | None, start_id: str | None,
    began: tuple[str, ...] | None, safe_z: float | None, spindle_wait: float, plunge_feed: float, yes: bool,
    keep_going: bool, dry_run: bool, number: bool, max_lines: int, as_json: bool,
) -> None:  # fmt: skip
    """Stream a G-code FILE to a controller.

    Keys while it runs: ! hold, ~ resume, + - feed override, 0 back to 100 %, x reset, q quit. Ctrl-C holds the feed
    and asks; a second one resets immediately.
    """
    if from_line is None:
        refuse_given(ctx, FOR_A_RESUME, "has no effect without --from-line", hint="--from-line N resumes at line N")
    approach = Approach(safe_z, spindle_wait, plunge_feed)
    options = SendOptions(file, from_line, start_id, began, approach, yes, keep_going, dry_run, number)
    program = job_program(file.name, read_job(file), max_lines)
    check_resume(program, from_line)
    show_ending(file.name, program)
    with connected(target) as client:
        outcome, restart = send(client, program, options)
    show(file.name, outcome, restart)
    if outcome.complete:
        show_ending(file.name, program)
    if as_json:
        ui.emit_json({**outcome_json(str(file), outcome), "lines_not_run": program.ending.unrun})
    ctx.exit(exit_code(outcome))


def exit_code(outcome: Outcome) -> Exit:
    """Of how the job ended; a refused line alone does not hide that the link was lost."""
    return Exit.OK if outcome.complete else EXITS.get(outcome.end, Exit.JOB)


def job_program(name: str, data: bytes, lines_max: int) -> Program:
    """The lines to send: those of the file, or those that its O words execute. Raises JobError."""
    source = read_program(name, data)
    if not source.may_jump:
        return source
    library = load_expand(ensure_host_library())
    if not needs_expansion(library, data):
        return read_program(name, data, jumps=False)
    return expanded_program(name, source, data, expand(library, name, data, Start.ANYWHERE, lines_max))


def show_ending(file: str, program: Program) -> None:
    """What follows the program in its file is not sent: before the job, and after it."""
    if words := program.ending.words:
        ui.warn(f"{file}: {words}", program.ending.hint)


def check_resume(program: Program, from_line: int | None) -> None:
    """Raises JobError for a program whose state cannot be rebuilt from its lines alone."""
    if from_line and (program.expanded or program.computes):
        raise JobError(
            "a program with parameters cannot be resumed: their values at that line are unknown",
            hint="`wificnc expand FILE -o OUT` makes plain lines of it; send OUT, and resume that",
        )


def send(client: Client, program: Program, options: SendOptions) -> tuple[Outcome, str]:
    """The whole conversation, and where the job may be resumed."""
    expect_state(client, "Idle")
    client.synchronise()
    built = client.options()
    settings = client.settings()
    start_id = client.start_id()
    if options.from_line:
        check_same_start(options.start_id, start_id)
    facts = machine_facts(client, settings)
    if options.began is not None:
        facts = replace(facts, modes=options.began)
    lines, preamble = program.lines, 0
    if options.from_line:
        library: ctypes.CDLL = load_rebuild(ensure_host_library())
        resume = plan_resume(library, program, options.from_line, facts, options.approach)
        confirm(resume, program, options)
        lines, preamble = resume.lines, len(resume.preamble)
    can_number = options.number and built is not None and LINE_NUMBERS in built.flags
    longest = longest_line(built.rx_bytes if built else 0)
    with estimate(lines, settings, client) as times, check_mode(client, options.dry_run):
        run = RunOptions(
            built, options.keep_going or options.dry_run, options.dry_run, times, can_number, program.written, preamble
        )
        with Keyboard() as keys, JobDisplay(options.file.name) as display:
            outcome = JobRun(client, ready(lines, can_number, longest), display, keys, run).run()
    restart = restart_hint(program, outcome, facts, options)
    if RESUMABLE in restart:
        restart += conditions(start_id, facts.modes)
    return outcome, restart


def conditions(start_id: str, modes: tuple[str, ...]) -> str:
    """What else a resume has to know of the first part."""
    words = f" Add --start-id {start_id}: then `send` refuses if the controller has restarted." if start_id else ""
    if others := "".join(word for word in modes if word[0] == "G" and word not in MODES_OF_RESET):
        words += f" Add --began {others}: a stop by reset leaves other modes than those in which the job began."
    return words


def check_same_start(wanted: str | None, found: str) -> None:
    """Raises JobError: the controller has restarted since the first part of the job, so its position is another."""
    if wanted is None:
        if found:
            ui.warn("without --start-id a restart of the controller since the first part is not noticed")
    elif wanted.upper() != found.upper():
        raise JobError(
            f"the controller has restarted since the first part of the job (start id {found or 'none'}, not {wanted}): "
            "its position is lost",
            hint="home it or set the zero of the work again, then resume without --start-id",
        )


def restart_hint(program: Program, outcome: Outcome, facts: MachineFacts, options: SendOptions) -> str:
    """Where the job may be resumed; "" when there is nothing to resume."""
    wanted = wanted_line(outcome)
    if wanted is None or options.dry_run:
        return ""
    try:
        library = load_rebuild(ensure_host_library())
    except BuildError as err:
        return f"--from-line is not possible here: {err.message.splitlines()[0]}"
    return restart_words(library, program, wanted, facts, options.approach)


@contextmanager
def check_mode(client: Client, on: bool) -> Iterator[None]:
    """$C around a dry run. Switching it off resets the controller, as Grbl does."""
    if on:
        client.must("$C")
    yield
    if on and client.look().status.state == "Check":
        client.must("$C")


@contextmanager
def estimate(lines: tuple[JobLine, ...], settings: dict[int, str], client: Client) -> Iterator[Estimate | None]:
    """The simulator's times while the job runs; None where there is no simulator."""
    try:
        library = load_library(ensure_host_library())
    except BuildError as err:
        ui.note(f"no time estimate: {err.message.splitlines()[0]}")
        yield None
        return
    times = Estimate(library, lines, settings, len(client.now().mpos))
    try:
        yield times
    finally:
        times.stop()


def machine_facts(client: Client, settings: dict[int, str]) -> MachineFacts:
    """Positions and offsets that the controller reports, in mm. Reports are in inches with $13=1."""
    unit = unit_mm(settings)
    now = client.look_fully()
    return MachineFacts(
        axis_count=len(now.mpos),
        work_mm=in_mm(now.wpos, unit),
        machine_mm=in_mm(now.mpos, unit),
        offsets={key: in_mm(values, unit) for key, values in client.offsets().items()},
        laser=settings.get(32) == "1",
        modes=modes_of(client.parser_state()),
    )


def in_mm(values: tuple[float, ...], unit: float) -> tuple[float, ...]:
    """X Y Z in mm; the turning axes are in degrees whatever the unit."""
    return (*(unit * value for value in values[:3]), *values[3:])


def confirm(resume: Resume, program: Program, options: SendOptions) -> None:
    """Show what will be done first, and ask. Raises UserError when no one can be asked, JobError after a no."""
    ui.talk.print(f"Before line {resume.line} these lines are sent:")
    for line in resume.preamble:
        ui.talk.print(f"    {line.code}", markup=False)
    ui.talk.print(f"then {options.file.name} from line {resume.rest[0].number}:")
    ui.talk.print(f"    {resume.rest[0].text.strip()}", markup=False, soft_wrap=True)
    for note in (*resume.notes, *system_notes(resume, program, options)):
        ui.warn(note)
    if options.yes or options.dry_run:
        return
    if not sys.stdin.isatty():
        raise UserError(
            "a resume needs confirmation before the first motion, and this is not a terminal", hint="--yes in scripts"
        )
    if not click.confirm("Is the path free? Start the resume?", err=True):
        raise JobError("nothing was sent")


def system_notes(resume: Resume, program: Program, options: SendOptions) -> list[str]:
    """A program that names no work system runs in that of the controller, which a reset has made G54."""
    before = (words_of(line.code) for line in program.lines if line.number < resume.line)
    if options.began is not None or any(
        letter == "G" and 54 <= code < 60 for words in before for letter, code in words
    ):
        return []
    return [
        f"the lines before name no work system: the resume takes {resume.state.wcs}, the controller's now. If the job "
        "began in another one, give that: --began G55"
    ]


def show(file: str, outcome: Outcome, restart: str) -> None:
    """The summary."""
    for line in fate_lines(outcome, restart):
        ui.talk.print(line, markup=False, soft_wrap=True)
    verdict = (
        "finished" if outcome.complete else "finished with errors" if outcome.end is End.FINISHED else "NOT finished"
    )
    ui.talk.print(
        f"[bold]{file}[/] {verdict}: {outcome.answered:,} of {outcome.lines:,} lines, "
        f"{len(outcome.errors)} error{'s' * (len(outcome.errors) != 1)}, {clock(outcome.elapsed_s)}",
        soft_wrap=True,
    )
    ui.talk.print(f"at {final_position(outcome.snapshot)}", soft_wrap=True)


def outcome_json(file: str, outcome: Outcome) -> dict[str, Any]:
    """The document of --json. The keys are a contract with scripts."""

    def number(line: JobLine | None) -> int | None:
        return line.number if line else None

    return {
        "file": file,
        "end": outcome.end.value,
        "detail": outcome.detail,
        "lines": outcome.lines,
        "lines_sent": outcome.sent,
        "lines_answered": outcome.answered,
        "last_answered_line": number(outcome.last_answered),
        "running_line": number(outcome.running),
        "unanswered_lines": [line.number for line in outcome.unanswered],
        "errors": [
            {"line": error.line.number, "code": error.code, "text": error.line.text} for error in outcome.errors
        ],
        "elapsed_s": round(outcome.elapsed_s, 3),
        "state": outcome.snapshot.state,
        "work_position": position_json(outcome.snapshot.wpos),
        "machine_position": position_json(outcome.snapshot.mpos),
        "messages": list(outcome.messages),
    }
