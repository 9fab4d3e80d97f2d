"""Parameters: LinuxCNC's documentation in its own words ("G-code Overview"), our limits, every error."""

from __future__ import annotations

import re
from ctypes import CDLL

import pytest
from compute_bench import Bench
from gcode_core import ROOT, XYZABC
from hypothesis import given
from hypothesis import strategies as st

CONFIG = (ROOT / "core/config.h").read_text()
NUMBERED = int(re.search(r"PARAMS_NUMBERED +(\d+)", CONFIG)[1])
NAMED = int(re.search(r"PARAMS_NAMED +(\d+)", CONFIG)[1])


@pytest.fixture
def bench(lib: CDLL) -> Bench:
    return Bench(lib, XYZABC)


def test_a_setting_takes_effect_after_the_line(bench: Bench) -> None:
    """if parameter 3 has been previously set to 15 and the line '#3=6 G1 X#3' is interpreted, a straight move to a
    point where X equals 15 will occur and the value of parameter 3 will be 6."""
    bench.run("F100", "#3 = 15")
    assert bench.plain("#3=6 G1 X#3") == "G1X15"
    assert bench.position()[0] == 15
    assert bench.value("#3") == 6


def test_the_last_setting_of_a_line_wins(bench: Bench) -> None:
    bench.run("#1=5 #1=6")
    assert bench.value("#1") == 6
    bench.run("#1=3 #1=[#1+1]")  # rs274: 7, as #1 is still 6 when the line is read
    assert bench.value("#1") == 7


def test_settings_and_words_mix(bench: Bench) -> None:
    assert bench.plain("G0 X1 #1=5 Y2") == "G0X1Y2"
    assert bench.value("#1") == 5


def test_unset_numbers_are_zero_and_unset_names_an_error(bench: Bench) -> None:
    """Uninitialized global parameters ... return the value zero ... Uninitialized named parameters signal an error"""
    assert bench.value("#31") == 0
    assert bench.value("#5000") == 0
    assert bench.value("#<nobody>") == "PARAMETER_UNSET"


def test_names_without_case_and_blanks(bench: Bench) -> None:
    """'#<param>' and '#<P a R am >' refer to the same parameter."""
    bench.run("#<param>=8")
    assert bench.value("#<P a R am >") == 8


def test_exists(bench: Bench) -> None:
    """The EXISTS function tests whether a given named parameter exists."""
    assert bench.value("EXISTS[#<it>]") == 0
    bench.run("#<it>=0")
    assert bench.value("EXISTS[#<it>]") == 1
    assert bench.value("EXISTS[#<_x>]") == 1
    assert bench.value("EXISTS[#<_it>]") == 0
    assert bench.value("EXISTS[#31]") == 1
    assert bench.value("EXISTS[#5003]") == 0


@pytest.mark.parametrize("name", ["a", "_qq", "n" * 31, "a-b", "1", "a.b", "a=b"])
def test_names(bench: Bench, name: str) -> None:
    bench.run(f"#<{name}>=4")
    assert bench.value(f"#<{name}>") == 4
    for other in (name[:-1], f"{name[:-1]}z", name[1:]):
        assert bench.value(f"#<{other}>") in ("PARAMETER_UNSET", "PARAMETER_NAME")


@pytest.mark.parametrize(
    ("line", "error"),
    [
        ("#5001=1", "PARAMETER_READ_ONLY"),
        ("#5221=1", "PARAMETER_READ_ONLY"),
        ("#5420=3", "PARAMETER_READ_ONLY"),
        ("#65535=3", "PARAMETER_READ_ONLY"),
        ("#<_x>=3", "PARAMETER_READ_ONLY"),
        ("#<_value>=3", "PARAMETER_READ_ONLY"),
        ("#0=3", "PARAMETER_NUMBER"),
        ("#1.5=3", "PARAMETER_NUMBER"),
        ("#<>=3", "PARAMETER_NAME"),
        ("#1", "PARAMETER_ASSIGNMENT"),
        ("#1 X5", "PARAMETER_ASSIGNMENT"),
        ("#1=", "BAD_NUMBER"),
        ("#1==2", "BAD_NUMBER"),
        ("#1=#2/3", "EXPECTED_LETTER"),
        ("#<a>=#<a>", "PARAMETER_UNSET"),
        ("[1]", "EXPECTED_LETTER"),
        ("X[1]]", "EXPECTED_LETTER"),
        ("X#1 Y", "BAD_NUMBER"),
        ("X--3 Y#1", "BAD_NUMBER"),
        ("X[1+1] X2", "WORD_REPEATED"),
        ("G[1+1.5] X#1", "NOT_INTEGER"),
        ("G[1.04] X1", "NOT_INTEGER"),
        ("X[10**15]", "EXPRESSION_RESULT"),
        ("X[10**6]", "BAD_TARGET"),
        ("T[-1]", "NEGATIVE"),
        ("O100 SUB", "O_WORD"),
        ("N5 O<A> CALL [#1]", "O_WORD"),
        ("G0 X#1 O1 IF [1]", "O_WORD"),
        ("#1=1" * 65, "LINE_TOO_LONG"),
    ],
)
def test_errors(bench: Bench, line: str, error: str) -> None:
    assert bench.answer(line) == error


@pytest.mark.parametrize(
    "line", ["#1=5 X[1/0]", "#1=5 #5420=1", "#1=5 #2=", "#1=5 G999", "#1=5 X[10**9]", "#1=5 Z1 Z2"]
)
def test_a_refused_line_sets_nothing(bench: Bench, line: str) -> None:
    bench.run("#1=3")
    assert bench.answer(line) != "OK"
    assert bench.value("#1") == 3


def test_room_for_numbers(bench: Bench) -> None:
    """#1..#30 always, and so many of #31..#5000."""
    bench.run(*(f"#{n}={n}" for n in range(1, 31)))
    bench.run(*(f"#{5000 - 7 * n}={n}" for n in range(NUMBERED - 1)))
    assert bench.answer("#40=1 #41=2") == "PARAMETER_ROOM"
    assert bench.value("#40") == 0, "both or none"
    bench.run("#42=3")
    assert bench.answer("#43=1") == "PARAMETER_ROOM"
    bench.run("#42=4", "#30=5", f"#5000={NUMBERED}")
    assert (bench.value("#42"), bench.value("#30"), bench.value("#5000")) == (4, 5, NUMBERED)


def test_room_for_names(bench: Bench) -> None:
    bench.run(*(f"#<{'_' * (n % 2)}n{n}>={n}" for n in range(NAMED)))
    assert bench.answer("#<more>=1") == "PARAMETER_ROOM"
    assert [bench.value(f"#<{'_' * (n % 2)}n{n}>") for n in range(NAMED)] == list(range(NAMED))
    bench.clear()
    assert bench.value("#<n2>") == "PARAMETER_UNSET"
    bench.run("#<more>=1")


@given(st.dictionaries(st.integers(1, 5000), st.floats(-1e9, 1e9), max_size=NUMBERED))
def test_numbers_keep_their_values(lib: CDLL, values: dict[int, float]) -> None:
    bench = Bench(lib)
    for number, value in values.items():
        bench.run(f"#{number}={value:.6f}")
    for number, value in values.items():
        assert bench.value(f"#{number}") == float(f"{value:.6f}")


@given(st.floats(-1e14, 1e14))
def test_a_computed_word_is_good_to_15_digits(lib: CDLL, value: float) -> None:
    """The plain line says what was computed: a number of up to 15 digits comes out as it went in."""
    text = f"{value:.15g}"
    if "e" in text:
        text = f"{value:.12f}"
    bench = Bench(lib)
    bench.run(f"#1={text}")
    assert float(bench.plain("S[ABS[#1]]")[1:]) == pytest.approx(abs(bench.value("#1")), rel=1e-15, abs=1e-22)


@pytest.mark.parametrize(
    ("line", "plain"),
    [
        ("X[1/3]", "X0.333333333333333"),
        ("X[0.1+0.2]", "X0.3"),
        ("X[-0.5]", "X-0.5"),
        ("X[1-1]", "X0"),
        ("X-[0]", "X0"),
        ("X[100]", "X100"),
        ("X[1/1024]", "X0.0009765625"),
        ("X12.500 Y[1]", "X12.500Y1"),
        ("G[80+0.0000001] #1=2", "G80"),
        ("G[43+0.1] Z[1]", "G43.1Z1"),
        ("G#1 X#2", "G0X0"),
        ("#1=2", ""),
    ],
)
def test_plain_lines(bench: Bench, line: str, plain: str) -> None:
    assert bench.plain(line) == plain


# What the interpreter and the machine know.


def readings(bench: Bench, *texts: str) -> list[float | str]:
    return [bench.value(text) for text in texts]


def test_position(bench: Bench) -> None:
    """5420-5428: Current relative position in the active coordinate system including all offsets and in the current
    program units; #<_x>: Same as #5420; #<_abs_x>: current absolute X coordinate (G53) including no offsets."""
    bench.run("G10 L2 P2 X1 Y2", "G55 G0 X10 Y20 Z30 A40 B50 C60")
    assert readings(bench, "#5420", "#5421", "#5422", "#5423", "#5424", "#5425", "#5426") == [10, 20, 30, 40, 50, 60, 0]
    assert readings(bench, "#<_x>", "#<_y>", "#<_z>", "#<_a>", "#<_b>", "#<_c>") == [10, 20, 30, 40, 50, 60]
    assert readings(bench, "#<_abs_x>", "#<_abs_y>", "#5021", "#5024") == [11, 22, 11, 40]
    bench.run("G20")
    assert readings(bench, "#5420", "#<_abs_x>", "#<_a>") == [pytest.approx(10 / 25.4), pytest.approx(11 / 25.4), 40]
    bench.run("G21 G92 X7", "G43.1 Z3")
    assert readings(bench, "#5420", "#5422", "#5210", "#5211") == [7, 27, 1, 3]


def test_stored_rows(bench: Bench) -> None:
    """5161-5169 G28, 5181-5189 G30, 5221-5230 G54, 5241-5250 G55 ... R denotes the XY rotation angle. rs274: they are
    in the machine's units, whatever the program's."""
    bench.run("G10 L2 P1 X1 C3", "G10 L2 P9 Y-4", "G0 X10 Y20 Z30", "G28.1", "G0 X5", "G30.1", "G20")
    assert readings(bench, "#5221", "#5226", "#5227", "#5230", "#5382", "#5390") == [1, 3, 0, 0, -4, 0]
    assert readings(bench, "#5161", "#5162", "#5163", "#5169", "#5181") == [11, 20, 30, 0, 6]
    assert bench.value("#5231") == "PARAMETER_NUMBER"


def test_coordinate_system(bench: Bench) -> None:
    """5220: Coordinate System number 1 - 9 for G54 - G59.3; if your in G55 ... 550.000000 and if your in G59.1 ...
    591.000000."""
    for number, (code, value) in enumerate(
        [("G54", 540), ("G55", 550), ("G59", 590), ("G59.1", 591), ("G59.2", 592), ("G59.3", 593)]
    ):
        bench.run(code)
        assert readings(bench, "#5220", "#<_coord_system>") == [[1, 2, 6, 7, 8, 9][number], value]


def test_probe_result(bench: Bench) -> None:
    """5061-5069: Coordinates of a G38 probe result; 5070: 1 if success."""
    assert readings(bench, "#5061", "#5070") == [0, 0]
    bench.probe([25.4, 2, -3, 4, 5, 6], True)
    assert readings(bench, "#5061", "#5063", "#5066", "#5069", "#5070") == [25.4, -3, 6, 0, 1]
    bench.run("G20")
    assert readings(bench, "#5061", "#5064") == [1, 4]


def test_tool(bench: Bench) -> None:
    """5400: Tool Number; #<_current_tool> the same; #<_selected_tool>: post a T code; 5403: its stored offset; 5083:
    the offset in effect."""
    bench.run("G10 L1 P3 Z12.5", "T3")
    assert readings(bench, "#5400", "#<_current_tool>", "#<_selected_tool>", "#5403") == [0, 0, 3, 0]
    bench.run("M6")
    assert readings(bench, "#5400", "#<_current_tool>", "#5403", "#5083", "#<_tool_offset>") == [3, 3, 12.5, 0, 0]
    bench.run("G43")
    assert readings(bench, "#5083", "#<_tool_offset>") == [12.5, 1]


@pytest.mark.parametrize(
    ("line", "name", "value"),
    [
        ("G20", "_metric", 0), ("G20", "_imperial", 1), ("G21", "_metric", 1), ("G21", "_imperial", 0),
        ("G90", "_absolute", 1), ("G90", "_incremental", 0), ("G91", "_absolute", 0), ("G91", "_incremental", 1),
        ("G93", "_inverse_time", 1), ("G94", "_inverse_time", 0), ("G94", "_units_per_minute", 1),
        ("G90.1", "_ijk_absolute_mode", 1), ("G91.1", "_ijk_absolute_mode", 0), ("G40", "_ccomp", 400),
        ("G17", "_plane", 170), ("G18", "_plane", 180), ("G19", "_plane", 190),
        ("M3 S1000", "_spindle_on", 1), ("M3 S1000", "_spindle_cw", 1), ("M4 S1", "_spindle_cw", 0),
        ("M4 S1", "_spindle_on", 1), ("M5", "_spindle_on", 0), ("S1234.5", "_rpm", 1234.5),
        ("M7", "_mist", 1), ("M7", "_flood", 0), ("M8", "_flood", 1), ("M9", "_flood", 0),
        ("F100", "_feed", 100), ("G20 F33", "_feed", 33), ("F1234.5", "_feed", 1234.5),
        ("G0 X0", "_motion_mode", 0), ("G1 F1 X0", "_motion_mode", 10), ("G2 F1 X1 I0.5", "_motion_mode", 20),
        ("G80", "_motion_mode", 800), ("G81 F1 X1 Z-1 R1", "_motion_mode", 810), ("G38.3 F1 X1", "_motion_mode", 383),
        ("G98", "_retract_old_z", 1), ("G99", "_retract_r_plane", 1), ("G99", "_retract_old_z", 0),
        ("M49", "_feed_override", 0), ("M48", "_feed_override", 1), ("M51 P0", "_speed_override", 0),
        ("M53 P0", "_feed_hold", 0), ("G4 P0", "_line", 7), ("G4 P0", "_call_level", 0),
        ("G4 P0", "_value", 0), ("G4 P0", "_value_returned", 0),
    ],
)  # fmt: skip
def test_named_readings(bench: Bench, line: str, name: str, value: float) -> None:
    bench.run(line)
    assert bench.value(f"#<{name}>") == value


def test_documentation_lists_every_name() -> None:
    table = (ROOT / "core/gcode/readings.def").read_text()
    names = {name.lower() for name in re.findall(r'READING\("(\w+)"', table)}
    said = set(re.findall(r"`#<(_\w+)>`", (ROOT / "docs/gcode-programs.md").read_text()))
    assert names == said - {"_name"}
