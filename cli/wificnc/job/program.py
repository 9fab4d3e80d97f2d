"""A G-code file -> the lines that go to the controller.

Comments and blanks stay here, but for those that the controller keeps or shows (a tool's text, a tool change): that
saves a third of the bytes, and a `!`, `?`, `~` or UTF-8 byte in a comment never gets near a controller, which would
take it for a real-time command. The same bytes in code are an error before the job begins. Line numbers are those of
the file, as editors and `wificnc sim` count them.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace

from wificnc.connection.typed import NOT_IN_A_COMMENT, kept_comment
from wificnc.errors import JobError
from wificnc.job.ending import MARK, Ending
from wificnc.job.expand import Expanded
from wificnc.job.shown import Written, as_written

WORD = re.compile(r"([A-Z])([-+]?[0-9]*\.?[0-9]*)")
CODE_CHARACTERS = frozenset(range(0x21, 0x7F)) - set(b"!?~")
O_LINE = re.compile(rb"(?:N[0-9]+)?O")  # may be one with an O word
OWN_NUMBER = re.compile(r"(?:^|(?<=[0-9.]))N[0-9.]+")
# $ lines that end a job, or take from it that it moves: (what the line begins with, why it is refused)
NOT_IN_A_JOB = {
    b"$C": "$C switches check mode, and no line after it moves: use `wificnc send --dry-run`",
    b"$SLP": "after $SLP the controller sleeps until a reset and reads no line",
    b"$RST=": "$RST= restores defaults and resets the controller",
}
LONGEST_CODE = 79  # characters that every controller takes
LONGEST_LINE = 256  # ... that ours take (core/config.h), and others with a large receive buffer
LARGE_RX_BYTES = 1000
FAULTS_SHOWN = 5
SHOWN_MAX = 200  # characters of a line in a message


@dataclass(frozen=True)
class JobLine:
    """One line of the job."""

    number: int  # 1-based in the file; 0 = put in front by --from-line
    text: str  # as written in the file, for people
    wire: bytes
    comment: bytes = b""  # in its brackets: what the controller keeps or shows of the line's comments

    @property
    def code(self) -> str:
        """Without comments and blanks, upper case."""
        return self.wire.decode("ascii").rstrip("\n")

    @property
    def alone(self) -> bool:
        """$ lines are refused while the machine moves."""
        return self.wire.startswith(b"$")

    @property
    def title(self) -> str:
        """line 12 (G1 X10)"""
        return f"line {self.number} ({self.text.strip()})" if self.number else f"the resume's line {self.code}"


@dataclass(frozen=True)
class Program:
    """A file's lines, without those that mean nothing to a controller."""

    lines: tuple[JobLine, ...]
    file_lines: int
    mark_lines: int  # % and program numbers: not sent
    ending: Ending = field(default_factory=Ending)  # what of the file is not run
    written: Written = str  # a message about a comment of it -> the comment as written
    expanded: bool = False  # a line of the file may come several times, and others not at all

    @property
    def may_jump(self) -> bool:
        """It may have O words."""
        return any(O_LINE.match(line.wire) for line in self.lines)

    @property
    def computes(self) -> bool:
        """It has expressions or parameters."""
        return any("#" in line.code or "[" in line.code for line in self.lines)

    @property
    def longest(self) -> int:
        """Bytes of the longest line on the wire."""
        return max((len(line.wire) for line in self.lines), default=0)


def split_lines(data: bytes) -> list[bytes]:
    """Lines as the controller counts them: LF, CR and CR LF end one, and nothing else does."""
    text = data.removeprefix(b"\xef\xbb\xbf").replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    lines = text.split(b"\n")
    return lines[:-1] if not lines[-1].rstrip(b"\x1a") else lines


def printable(text: bytes) -> str:
    """A line for people, with escapes where it is not fit to print."""
    whole = decoded(text).rstrip()
    cut = f"{whole[:SHOWN_MAX]}…" if len(whole) > SHOWN_MAX else whole
    return "".join(c if c.isprintable() or c == "\t" else f"\\x{ord(c):02x}" for c in cut).rstrip()


def decoded(text: bytes) -> str:
    """UTF-8, or else what editors of Windows write."""
    try:
        return text.decode("utf-8")
    except UnicodeDecodeError:
        return text.decode("cp1252", "backslashreplace")


def code_of(line: bytes) -> bytes:
    """The line without blanks and comments, upper case: what the controller keeps of it."""
    kept = bytearray()
    at = 0
    while at < len(line):
        byte = line[at]
        if byte == ord(";"):
            break
        if byte == ord("("):
            end = line.find(b")", at)
            if end < 0:
                break
            at = end
        elif byte > ord(" "):
            kept.append(byte)
        elif byte not in b" \t\v\f":
            kept.append(byte)  # a control character: found by read_program()
        at += 1
    return bytes(kept).upper()


def read_program(name: str, data: bytes, jumps: bool | None = None) -> Program:
    """The lines of a job, up to its end.

    Args:
        jumps: it has O words, so M2 and M30 end it where they are executed, not in the order of lines; None: look.

    Raises:
        JobError: code holds bytes that a controller takes for real-time commands, a $ line that no job may have, or
            there is nothing to send.
    """
    lines: list[JobLine] = []
    faults: list[str] = []
    raw_lines = split_lines(data)
    codes = [code_of(raw) for raw in raw_lines]
    if jumps is None:
        jumps = any(O_LINE.match(code) and not MARK.fullmatch(code) for code in codes)
    ending = Ending()
    marks = 0
    for number, (raw, code) in enumerate(zip(raw_lines, codes, strict=True), 1):
        runs = ending.take(code, number, not jumps)
        if MARK.fullmatch(code):
            marks += 1
        elif runs and (code or b"," in raw):
            line = JobLine(number, printable(raw), code + b"\n", _comment(raw, code))
            if not code and not line.comment:
                continue
            faults += [f"{name}:{number}: {fault}" for fault in [_fault(raw, line)] if fault]
            lines.append(line)
    if faults:
        raise JobError(faults_text(faults), hint="nothing was executed; correct the file first")
    if not any(line.code for line in lines):
        raise JobError(f"{name} has no G-code")
    pairs = ((decoded(raw), code.decode("ascii", "replace")) for raw, code in zip(raw_lines, codes, strict=True))
    return Program(tuple(lines), len(raw_lines), marks, ending, as_written(pairs))


def faults_text(faults: Sequence[str]) -> str:
    """The first of them, and how many there are."""
    more = [f"and {len(faults) - FAULTS_SHOWN} more lines like these"] if len(faults) > FAULTS_SHOWN else []
    return "\n".join([*faults[:FAULTS_SHOWN], *more])


def _comment(raw: bytes, code: bytes) -> bytes:
    """What the controller keeps or shows of the comments of a line."""
    return kept_comment(decoded(raw), code.decode("ascii", "replace")).encode("ascii", "replace")


def _fault(raw: bytes, line: JobLine) -> str:
    """Why a line cannot be sent, or ""."""
    code = line.wire.rstrip(b"\n")
    if b")" in code:
        return f"a comment ends at its first ): take out the bracket within it: {printable(raw)}"
    if bad := [byte for byte in code if byte not in CODE_CHARACTERS]:
        return f"{_byte_name(bad[0])} is not G-code: {printable(raw)}"
    if why := why_not_in_a_job(code):
        return why
    fault = _comment_fault(code, line.comment)
    return f"{fault}: {printable(raw)}" if fault else ""


def _comment_fault(code: bytes, comment: bytes) -> str:
    """Why a tool's text cannot be sent, or ""."""
    if NOT_IN_A_COMMENT.search(comment.decode("ascii")):
        return "a tool's text has letters without accents, digits and signs, but none of ! ? ~"
    return "" if len(code + comment) <= LONGEST_LINE or b"G10" not in code else f"more than {LONGEST_LINE} characters"


def why_not_in_a_job(code: bytes) -> str:
    """Of a $ line that no job may have, whether it is sent, simulated or checked; else ""."""
    for begin, why in NOT_IN_A_JOB.items():
        if code == begin or (begin.endswith(b"=") and code.startswith(begin)):
            return why
    return ""


def expanded_program(name: str, source: Program, data: bytes, done: Expanded) -> Program:
    """The plain lines that a program executes, with the numbers of the lines they came from.

    Raises:
        JobError: there are none, or a tool's text cannot be sent.
    """
    lines = tuple(
        JobLine(number, printable(line), line + b"\n", comment)
        for number, line, comment in expanded_lines(name, data, done)
    )
    if not lines:
        raise JobError(f"{name} executes no lines")
    return replace(source, lines=lines, expanded=True, ending=done.ending)


def expanded_lines(name: str, data: bytes, done: Expanded) -> list[tuple[int, bytes, bytes]]:
    """The plain lines of a program: number in the file, code, and what the controller keeps or shows of its comments.

    Raises:
        JobError: a tool's text cannot be sent.
    """
    raw_lines = split_lines(data)
    lines = []
    for number, line, raw in zip(done.numbers, done.text.splitlines(), done.comments.split(b"\n"), strict=False):
        comment = kept_comment(decoded(raw), code_of(line).decode("ascii")).encode("ascii", "replace")
        if fault := _comment_fault(line, comment):
            raise JobError(f"{name}:{number}: {fault}: {printable(raw_lines[number - 1])}")
        if line or comment:
            lines.append((number, line, comment))
    return lines


def longest_line(rx_bytes: int) -> int:
    """Characters of a line that a controller with this receive buffer takes."""
    return LONGEST_LINE if rx_bytes >= LARGE_RX_BYTES else LONGEST_CODE


def ready(lines: Iterable[JobLine], numbered: bool = True, longest: int = LONGEST_CODE) -> list[JobLine]:
    """The lines as they are sent: with the comments that the controller keeps or shows.

    Args:
        numbered: with their numbers in the file as N words, too, so that reports say which one is being made (Ln:). N
            words of the file's own give way. A line that would become too long goes without its number, or without
            what is only shown; a $ line as it is.
        longest: characters that the controller takes.

    Raises:
        JobError: a tool's text does not fit.
    """
    return [_ready(line, numbered, longest) for line in lines]


def _ready(line: JobLine, numbered: bool, longest: int) -> JobLine:
    if line.alone or not line.number:
        return line
    code, comment = line.code, line.comment.decode("ascii")
    whole = [code + comment]
    if numbered:
        code = OWN_NUMBER.sub("", code)
        whole = [f"N{line.number}{code}{comment}", code + comment, f"N{line.number}{code}"]
    fits = next((each for each in whole if len(each) <= longest), code)
    if comment and not fits.endswith(comment) and "G10" in code:
        raise JobError(f"{line.title}: this controller takes {longest} characters, and the tool's text would be lost")
    return replace(line, wire=fits.encode("ascii") + b"\n")


def _byte_name(byte: int) -> str:
    names = {ord("!"): "! (feed hold)", ord("~"): "~ (resume)", ord("?"): "? (status)", 0x18: "Ctrl-X (reset)"}
    return names.get(byte) or (f"byte 0x{byte:02X}")


def words_of(code: str) -> list[tuple[str, float]]:
    """Letters with their numbers, as far as they are plain: [("G", 1.0), ("X", 10.0)]."""
    found = []
    for letter, number in WORD.findall(code):
        try:
            found.append((letter, float(number)))
        except ValueError:
            continue
    return found
