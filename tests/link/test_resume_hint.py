"""The line that a stopped job proposes is one that --from-line accepts."""

from __future__ import annotations

from pathlib import Path

import pytest
from core_bridge import FAST, Bridge
from hypothesis import given, settings
from hypothesis import strategies as st
from sender import Nobody, Notes, advertised, talk
from test_resume import FACTS, LIBRARY, TOLD
from wificnc.commands.send import job_program
from wificnc.errors import JobError
from wificnc.job.fate import fate_lines, restart_words, wanted_line
from wificnc.job.program import Program, read_program
from wificnc.job.rebuild import Rebuild
from wificnc.job.resume import MachineFacts, nearest_resume, plan_resume
from wificnc.job.run import JobRun

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"

DRILLING = """G21 G90 G17
G0 Z5
G0 X10 Y10
G98 G81 X10 Y10 Z-3 R2 F200
X20
X30
Y20
G80
G0 X0 Y0
G83 X5 Y5 Z-8 R2 Q2 F200
X15
X25
G0 Z10
"""


def accepts(program: Program, line: int, facts: MachineFacts) -> bool:
    try:
        plan_resume(LIBRARY, program, line, facts)
    except JobError:
        return False
    return True


def check_every(program: Program, facts: MachineFacts, lines: list[int]) -> None:
    for line in lines:
        found = nearest_resume(LIBRARY, program, line, facts)
        if found.line is None:
            assert found.why_not
            continue
        assert found.line <= line
        assert accepts(program, found.line, facts), (line, found)
        assert (found.line == line) == (not found.why_not)


@pytest.mark.parametrize(("stopped", "proposed"), [(4, 4), (5, 4), (7, 4), (8, 4), (9, 9), (11, 10), (13, 10)])
def test_inside_a_row_of_cycles_the_rows_first_line_is_proposed(stopped: int, proposed: int) -> None:
    found = nearest_resume(LIBRARY, read_program("job.nc", DRILLING.encode()), stopped, FACTS)
    assert found.line == proposed
    assert ("canned cycles" in found.why_not) == (stopped != proposed)


@pytest.mark.parametrize("name", sorted(path.name for path in EXAMPLES.glob("*.n*c")))
def test_lines_of_the_examples(name: str) -> None:
    """Every line of the short ones; of the long ones the first, where the modes are set, and a sample of the rest."""
    program = job_program(name, (EXAMPLES / name).read_bytes(), 100_000)
    if program.expanded or program.computes:
        assert "wificnc expand" in restart_words(LIBRARY, program, 1, FACTS)
        return
    numbers = [job_line.number for job_line in program.lines]
    check_every(program, FACTS, [*numbers[:60], *numbers[60 :: max(1, len(numbers) // 25)], numbers[-1]])


MM = st.integers(-400, 400).map(lambda value: f"{value / 8:g}")
CYCLES = st.one_of(
    st.builds("G81X{}Y{}Z-2R1F100".format, MM, MM),
    st.builds("G83X{}Z-4R1Q1F100".format, MM),
    st.builds("G73Y{}Z-4R1Q1F90".format, MM),
    st.builds("G82X{}Z-2R1P.1F90".format, MM),
)
ROW = st.builds(
    lambda cycle, more, end: [cycle, *more, *end],
    CYCLES,
    st.lists(st.one_of(st.builds("X{}".format, MM), st.builds("Y{}".format, MM), CYCLES), max_size=4),
    st.sampled_from([["G80"], ["G0Z9"], [], ["M5"]]),
)
PARTS = st.one_of(
    ROW,
    st.builds(lambda n, x: [f"G1X{int(x) + i}F300" for i in range(n)], st.integers(1, 6), st.integers(0, 50)),
    st.builds(lambda x: [f"G91G0X{x}", "G90"], MM),
    st.builds(lambda x, y: [f"G0X{x}Y{y}Z5"], MM, MM),
    st.sampled_from(
        [["G53G0Z0"], ["G28G91Z0", "G90"], ["G92X0"], ["G20", "G0X1", "G21"], ["M3S900"], ["G5.1X9Y9I2J2"]]
    ),
)


@settings(max_examples=80)
@given(st.lists(PARTS, min_size=1, max_size=6), st.booleans())
def test_every_line_of_any_program(parts: list[list[str]], told: bool) -> None:
    facts = TOLD if told else FACTS
    text = "\n".join(["G21G90G17", *(line for part in parts for line in part), "G90G0X1Y1Z5"]) + "\n"
    with Rebuild(LIBRARY, 3) as rebuild:
        if any(rebuild.line(code.encode()) for code in text.splitlines()):
            return
    program = read_program("job.nc", text.encode())
    check_every(program, facts, [job_line.number for job_line in program.lines])


def test_a_program_that_jumps_is_resumed_as_what_it_expands_to() -> None:
    text = b"o100 sub\nG81 X1 Y1 Z-1 R1 F100\nX2\nG80\no100 endsub\nG21 G90 G0 Z5\no100 call\no100 call\nM2\n"
    program = job_program("sub.nc", text, 1000)
    assert program.expanded
    assert "wificnc expand" in restart_words(LIBRARY, program, 3, FACTS)
    plain = "\n".join(job_line.code for job_line in program.lines) + "\n"
    expanded = read_program("plain.nc", plain.encode())
    check_every(expanded, FACTS, [job_line.number for job_line in expanded.lines])


def test_what_is_said_names_the_line_and_the_reason() -> None:
    program = read_program("job.nc", DRILLING.encode())
    assert restart_words(LIBRARY, program, 3, FACTS) == (
        "To resume later: --from-line 3, or an earlier line with a safe approach."
    )
    assert restart_words(LIBRARY, program, 6, FACTS) == (
        "To resume later: --from-line 4. Line 6 cannot be resumed: the lines before are in a sequence of canned cycles "
        "or splines (G81)."
    )
    relative = read_program("job.nc", b"G91\nG0X1\nG0X2\nG0X3\n")
    assert "from the beginning" in restart_words(LIBRARY, relative, 4, FACTS)


@pytest.mark.parametrize("settings_line", ["$10=1\n", "$10=3\n"])
def test_a_drilling_job_that_was_stopped(settings_line: str) -> None:
    """As a user stops it: what is reported afterwards leads to a resume that is accepted."""
    holes = "".join(f"X{i % 40}\n" for i in range(200))
    text = f"G21G90G0Z5\nG0X1Y1\nG81X1Y1Z-3R2F900\n{holes}G80\nG0Z9\n"
    program = read_program("job.nc", text.encode())
    with Bridge(settings=FAST + settings_line) as bridge, talk(bridge) as client:
        bridge.slow_after(60)
        keys = Nobody()
        notes = Notes(lambda p: setattr(keys, "pressed", "\x03" if p.answered >= 60 else ""))
        outcome = JobRun(client, program.lines, notes, keys, advertised(128)).run()
        wanted = wanted_line(outcome)
        assert wanted is not None
        assert wanted > 4
        words = restart_words(LIBRARY, program, wanted, FACTS)
        assert "--from-line 3." in words
        assert fate_lines(outcome, words)[-1] == words


def test_a_refused_line_is_not_called_acknowledged() -> None:
    text = "G21\nG90\nG0 X1\nG1 X2 K1\nG0 X3\nG0 X4\n"
    program = read_program("job.nc", text.encode())
    with Bridge() as bridge, talk(bridge) as client:
        outcome = JobRun(client, program.lines, Notes(), Nobody(), advertised(10)).run()
    said = fate_lines(outcome)
    assert said[0].startswith("error: ")
    assert said[1].startswith("Last line acknowledged: line 3 (G0 X1). Line 4 (G1 X2 K1) was refused")
    assert wanted_line(outcome) is not None
    assert (wanted_line(outcome) or 0) <= 4  # it was not made, whatever came after it
