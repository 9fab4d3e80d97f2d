"""--from-line: the rest of a job, begun in the middle, ends where the whole job ends."""

from __future__ import annotations

import ctypes
from dataclasses import replace

import pytest
from core_bridge import Bridge
from hypothesis import given, settings
from hypothesis import strategies as st
from sender import Nobody, Notes, advertised, talk
from wificnc.build.host import ensure_host_library
from wificnc.errors import JobError
from wificnc.job.program import JobLine, Program, read_program
from wificnc.job.rebuild import ModalState, Rebuild, load_rebuild
from wificnc.job.resume import Approach, MachineFacts, plan_resume
from wificnc.job.run import JobRun

LIBRARY: ctypes.CDLL = load_rebuild(ensure_host_library())
ZEROS = (0.0, 0.0, 0.0)
OFFSETS = {
    "G54": (5.0, 6.0, -7.0), "G55": (10.0, 0.0, -2.0), "G56": ZEROS, "G57": ZEROS, "G58": ZEROS, "G59": ZEROS,
    "G28": (1.0, 2.0, 3.0), "G30": ZEROS, "G92": ZEROS, "TLO": (0.0,),
}  # fmt: skip
STOPPED_AT = (3.25, -4.5, -1.0)
FACTS = MachineFacts(3, STOPPED_AT, STOPPED_AT)
TOLD = MachineFacts(3, (-1.75, -10.5, 6.0), STOPPED_AT, OFFSETS)


JOB = """(a job with everything that is modal)
G21 G90 G17 G54
T3
S12000 M3
G0 Z5
G0 X10 Y10
M8
G1 Z-1 F150
G1 X20 F800
Y20
G2 X30 Y10 I0 J-10
X20 Y0 I-10
G91
G1 X-5
G90
G20
G1 X1 Y0.5 F20
G21
G18
G3 X20.4 Z-2 R5
G17
G93
G1 X10 Y10 F2
X20 F3
G94
G1 X0 F500
M9
G61
G0 Z5
M5
G0 X0 Y0
"""


def program_of(text: str) -> Program:
    return read_program("job.nc", text.encode())


def state_after(lines: tuple[JobLine, ...], facts: MachineFacts) -> ModalState:
    """The core's own parser over these lines, from where the machine is."""
    with Rebuild(LIBRARY, facts.axis_count) as rebuild:
        rebuild.set_position(facts.machine_mm + ZEROS)
        for row, values in facts.offsets.items():
            rebuild.set_offset(row, values + ZEROS)
        for line in lines:
            assert rebuild.line(line.wire[:-1]) == 0, line
        return rebuild.state()


def modes(state: ModalState) -> ModalState:
    """Without places, and without what is rounded on its way through text."""
    return replace(state, work_mm=(), machine_mm=(), moved=(), top_z_mm=0.0, feed_mm_min=0.0, tool_length_mm=0.0)


def assert_same(a: ModalState, b: ModalState) -> None:
    assert [round(value, 4) for value in a.work_mm] == [round(value, 4) for value in b.work_mm]
    assert abs(a.feed_mm_min - b.feed_mm_min) < 1e-3
    assert abs(a.tool_length_mm - b.tool_length_mm) < 1e-4
    assert modes(a) == modes(b)


@pytest.mark.parametrize("facts", [FACTS, TOLD], ids=["offsets unknown", "offsets known"])
@pytest.mark.parametrize("line", range(6, len(JOB.splitlines()) + 1))
def test_state_at_the_end_is_the_whole_jobs(line: int, facts: MachineFacts) -> None:
    program = program_of(JOB)
    resume = plan_resume(LIBRARY, program, line, facts)
    assert_same(state_after(resume.lines, facts), state_after(program.lines, facts))


LATHE = """G21G90G18
M3S600
G0X10Z5
G95F.2
G1Z0
X5
G33Z-5K1
Z-9K1
G0X10
G20G95F.01
G1X.1
G94F9
G1X.2
G0Z1
"""


@pytest.mark.parametrize("line", range(4, len(LATHE.splitlines()) + 1))
def test_feed_per_revolution_and_threads(line: int) -> None:
    program = program_of(LATHE)
    resume = plan_resume(LIBRARY, program, line, FACTS)
    assert_same(state_after(resume.lines, FACTS), state_after(program.lines, FACTS))


MM = st.integers(-500, 500).map(lambda value: f"{value / 8:g}")
WORDS = st.one_of(
    st.builds("G0X{}Y{}".format, MM, MM),
    st.builds("G1X{}F{}".format, MM, st.integers(10, 900)),
    st.builds("X{}Z{}".format, MM, MM),
    st.builds("G0Z{}".format, MM),
    st.builds("S{}M3".format, st.integers(1, 9000)),
    st.builds("G43.1Z{}".format, MM),
    st.builds("G91{}Y{}".format, st.sampled_from(["G0", "G1F100"]), MM),
    st.sampled_from(
        ["G90", "G20", "G21", "G18", "G17", "G54", "G55", "M5", "M7", "M9", "G61", "G64", "G80", "T4", "G90.1", "G49"]
    ),
)


@settings(max_examples=150)
@given(st.lists(WORDS, min_size=1, max_size=25), st.integers(1, 25), st.booleans())
def test_any_program_from_any_line(words: list[str], line: int, told: bool) -> None:
    facts = TOLD if told else FACTS
    text = "\n".join(["G0X1Y2Z3", "G1F100", *words, "G90G0X1Y1Z1"]) + "\n"
    with Rebuild(LIBRARY, 3) as rebuild:
        if any(rebuild.line(code.encode()) for code in text.splitlines()):
            return  # G80 and then axis words, a line that nothing allows
    program = program_of(text)
    resume = plan_resume(LIBRARY, program, min(line, len(words)) + 2, facts)
    assert_same(state_after(resume.lines, facts), state_after(program.lines, facts))


@pytest.mark.parametrize("line", [8, 11, 12, 20, 24, 31])
def test_final_position_on_the_real_core(line: int) -> None:
    program = program_of(JOB)
    positions = []
    for lines in (program.lines, plan_resume(LIBRARY, program, line, FACTS).lines):
        with Bridge() as bridge, talk(bridge) as client:
            client.must("G0X3.25Y-4.5Z-1")
            outcome = JobRun(client, lines, Notes(), Nobody(), advertised(128)).run()
            assert outcome.complete, outcome
            positions.append(bridge.position_steps())
    assert positions[0] == positions[1]


def test_way_back_goes_up_first_and_comes_down_last() -> None:
    resume = plan_resume(LIBRARY, program_of(JOB), 10, FACTS, Approach(spindle_wait_s=6, plunge_mm_min=90))
    assert [line.code for line in resume.preamble] == [
        "G21G90G94G17G54", "G0Z5", "T3", "M3S12000", "G4P6", "G0X20Y10", "M8", "G1Z-1F90", "F800", "G1",
    ]  # fmt: skip
    assert resume.rest[0].text == "Y20"


def test_never_down_to_the_safe_height() -> None:
    high = MachineFacts(3, (0.0, 0.0, 40.0), (0.0, 0.0, 40.0))
    assert plan_resume(LIBRARY, program_of(JOB), 10, high).preamble[1].code == "G0Z40"
    asked = plan_resume(LIBRARY, program_of(JOB), 10, high, Approach(safe_z_mm=55))
    assert asked.preamble[1].code == "G0Z55"


def test_first_arc_gets_its_word() -> None:
    resume = plan_resume(LIBRARY, program_of(JOB), 12, FACTS)
    assert resume.rest[0].code == "G2X20Y0I-10"


def test_laser_is_dark_on_the_way() -> None:
    text = "G21G90\nM4S300\nG1X10F600\nG1X20\n"
    resume = plan_resume(LIBRARY, program_of(text), 4, replace(FACTS, laser=True))
    codes = [line.code for line in resume.preamble]
    assert codes.index("M4S300") > codes.index("G0X10")
    assert not [code for code in codes if code.startswith("G4P")]


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("G91\nG0X5\nG90\nG1X1F9\n", 3, "where X should be is unknown"),
        ("G90\nG92X0Y0\nG0X5Y5\nG0X6\n", 4, "G92"),
        ("G53G0Z0\nG0X1\nG0X2\n", 3, "where Z should be is unknown"),
        ("G0X1\nG1X2\nG0X3\n", 3, r"line 2 \(G1X2\), before the resume: error:22"),
        ("G0X1\nG0X2\n", 3, "the last line with code is 2"),
    ],
)
def test_what_cannot_be_known_is_refused(text: str, line: int, words: str) -> None:
    with pytest.raises(JobError, match=words):
        plan_resume(LIBRARY, program_of(text), line, FACTS)


def test_known_offsets_make_g53_known() -> None:
    resume = plan_resume(LIBRARY, program_of("G0X1Y1\nG53G0Z0\nG0X2\n"), 3, TOLD)
    assert "G0Z7" in [line.code for line in resume.preamble]


def test_stored_offsets_are_mentioned() -> None:
    resume = plan_resume(LIBRARY, program_of("G10L2P1X0Y0Z0\nG0X1Y1Z1\nG0X2\n"), 3, TOLD)
    assert "G10" in resume.notes[0]


@pytest.mark.parametrize("facts", [FACTS, TOLD], ids=["offsets unknown", "offsets known"])
@pytest.mark.parametrize("modes", [("G55", "F100"), ("G57", "G20", "G91", "G18", "F300")], ids="".join)
def test_a_job_resumes_in_the_modes_in_which_it_began(facts: MachineFacts, modes: tuple[str, ...]) -> None:
    """A program that does not set them takes them from the controller, where a stop by reset has left others."""
    code = "G90X1Y1\nX2Y3\nX4\n"
    began = replace(facts, modes=modes)
    first = program_of("".join(modes) + "\n")
    whole = state_after((*first.lines, *program_of("G1" + code).lines), facts)
    resume = plan_resume(LIBRARY, program_of("G1" + code), 3, began)
    assert_same(state_after(resume.lines, facts), whole)


def test_modes_that_no_line_can_have_are_refused() -> None:
    with pytest.raises(JobError, match="modes in which the job began"):
        plan_resume(LIBRARY, program_of("G0X1\nX2\n"), 2, replace(FACTS, modes=("G54", "G55")))
