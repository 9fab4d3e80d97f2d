"""Expressions, parameters and O words: LinuxCNC goes the same way as the lines that we make of them."""

from __future__ import annotations

from collections.abc import Callable
from ctypes import CDLL
from pathlib import Path

import pytest
from canon import Refused, rs274
from compare import check_same
from compute_bench import Bench, ProgramError
from gcode_core import ROOT, XYZABC
from hypothesis import given, settings
from hypothesis import strategies as st
from ours import Ours

Agree = Callable[[str], int]

PROGRAMS = {
    "operators": "X[2**3**2]Y[1+2*3**2]|X[10-3-2]Y[7.5MOD2]Z[-7MOD3]|X[7MOD-3]Y[2*3EQ6]|X[1OR0AND0]Y[0OR2]Z[1XOR1]"
    "|X[3GT2]Y[3GE3]Z[3LT2]|X[2LE2]Y[1EQ1.00005]Z[1NE1.00015]|X[[1+2]*[3-1]/4]Y-[2]Z[--1]",
    "functions": "XSIN[30]YCOS[200]ZTAN[-40]|XASIN[0.3]YACOS[-0.2]ZATAN[1]/[-2]|XEXP[1.5]YLN[7]ZSQRT[2]"
    "|XFIX[-2.8]YFUP[-2.8]ZROUND[-2.5]|XFIX[2.8]YFUP[2.2]ZROUND[2.5]|XABS[-3.5]YATAN[0]/[-1]",
    "parameters": "#1=5#2=7 X#1Y#2|X#1Y#2|##1=9#<a b>=[#5+1] X[#1+1]|X#5Y#<ab>Z##1|X#[#1+0]|#1=3#1=[#1+1]|X#1Y-#1",
    "exists": "#<a>=0|XEXISTS[#<a>]YEXISTS[#<b>]ZEXISTS[#<_c>]",
    "position": "X3Y4Z5|G91X#5420Y#<_y>|G90G92X1|X[#5420+2]Y[#<_x>*3]|G43.1Z2|Z[#5422+1]",
    "positions in inches": "X30Y40|G20|X[#5420+1]Y[#<_y>*2]|G21|X[#<_x>/2]",
    "modes": "X#<_metric>Y#<_imperial>Z#<_absolute>|G91X#<_incremental>|G90X#<_motion_mode>Y[#<_plane>/10]"
    "|G18X[#<_plane>/10]Y#<_coord_system>|G55X[#5220]Y#<_coord_system>|G59.3X#5220Y#<_coord_system>|S500X#<_rpm>Y#<_feed>"
    "|M3X#<_spindle_on>Y#<_spindle_cw>|M8X#<_mist>Y#<_flood>|G90.1X#<_ijk_absolute_mode>|T4X#<_selected_tool>",
    "retract": "G98|X#<_retract_old_z>Y#<_retract_r_plane>|G99|X#<_retract_old_z>Y#<_retract_r_plane>",
    "number of the program": "O1000|X3|N5 o0007|X4",
    "while": "#1=0|o1 while [#1 LT 4]|G1X#1|#1=[#1+1]|o2 if [#1 EQ 2]|o1 continue|o2 endif|Y#1|o1 endwhile|X0",
    "do": "#1=0|o1 do|G1X#1|#1=[#1+1]|o2 if [#1 EQ 3]|o1 break|o2 endif|Y#1|o1 while [#1 LT 9]|X0",
    "repeat": "G91|o1 repeat [2.6]|X1|o2 repeat [0]|Y1|o2 endrepeat|o3 repeat [2]|Z1|o3 endrepeat|o1 endrepeat",
    "if": "#1=0|o1 repeat [4]|o2 if [#1 EQ 0]|X10|o2 elseif [#1 EQ 1]|X20|o2 elseif [#1 LT 3]|X30|o2 else|X40"
    "|o2 endif|#1=[#1+1]|o1 endrepeat",
    "call": "o1 sub|X#1Y#2Z#3|#1=7#2=8#40=[#40+1]|o1 endsub|#1=1#2=2#3=3|o1 call [10] [20]|X#1Y#2Z#3|o1 call|X#40",
    "return": "o1 sub|o2 if [#1 GT 5]|o1 return [#1*2]|o2 endif|X#1|o1 endsub [4]|o1 call [6]"
    "|X#<_value>Y#<_value_returned>|o1 call [3]|X#<_value>",
    "no value": "o1 sub|X3|o1 endsub|o2 sub|o2 endsub [5]|o2 call|X#<_value>|o1 call|X#<_value>Y#<_value_returned>",
    "modes saved": "G55|o1 sub|M73|G91G20G18|F7|G1X1Z1|o2 if [#1 GT 0]|o1 return|o2 endif|G0X1|o1 endsub|F9G1X5"
    "|o1 call [1]|X7|o1 call [0]|G1Y2|M70|G91|X1|M72|X1",
    "local names": "o1 sub|#<a>=5#<_g>=[#<_g>+1]|X#<a>YEXISTS[#<b>]|o1 endsub|#<a>=1#<b>=2#<_g>=3|o1 call|X#<a>Y#<_g>",
    "recursion": "o<f> sub|#<n>=#1|o1 if [#<n> LE 1]|o<f> return [1]|o1 endif|o<f> call [#<n>-1]"
    "|o<f> endsub [#<n>*#<_value>]|o<f> call [5]|X#<_value>",
    "computed label": "o5 sub|X#1|o5 endsub|#50=3|o[#50+2] call [9]|#51=5|o#51 call [4]",
    "calls in loops": "o1 sub|o2 repeat [2]|G91X#1|o2 endrepeat|G90|o1 endsub|#1=3|o3 while [#1 GT 0]|o1 call [#1]"
    "|#1=[#1-1]|o3 endwhile",
}  # fmt: skip


def plain_lines(lib: CDLL, program: str) -> list[str]:
    return [plain for _, plain in Bench(lib, XYZABC).program(program)]


@pytest.fixture(scope="session")
def agree_on(lib: CDLL, tmp_path_factory: pytest.TempPathFactory) -> Agree:
    """Ours: what we make of the program. Theirs: the program."""
    folder = tmp_path_factory.mktemp("programs")

    def compare(program: str) -> int:
        ours = Ours(lib, XYZABC)
        for line in plain_lines(lib, program):
            ours.run(line)
        check_same(ours.calls, rs274(program + "\nM2\n", folder))
        return len(ours.calls)

    return compare


@pytest.mark.parametrize("program", PROGRAMS.values(), ids=PROGRAMS.keys())
def test_program(agree_on: Agree, program: str) -> None:
    assert agree_on("G21G1F9\n" + program.replace("|", "\n")) > 0


def test_example(agree_on: Agree) -> None:
    assert agree_on((ROOT / "examples" / "bolt_circle.ngc").read_text()) > 8 * 6


VALUES = st.recursive(
    st.integers(-999, 999).map(lambda n: f"{n / 10}") | st.integers(1, 4).map(lambda n: f"#{n}"),
    lambda inner: (
        st.tuples(inner, st.sampled_from(["+", "-", "*", "MOD", "EQ", "GT", "LE", "AND", "OR", "XOR"]), inner).map(
            " ".join
        )
        | st.tuples(st.sampled_from(["ABS", "FIX", "FUP", "ROUND", "SIN", ""]), inner).map(
            lambda two: f"{two[0]}[{two[1]}]"
        )
    ),
    max_leaves=8,
)


@settings(max_examples=40)
@given(st.lists(VALUES, min_size=8, max_size=8))
def test_random_expressions(agree_on: Agree, values: list[str]) -> None:
    """What goes beyond the travel is brought back by MOD."""
    lines = [f"X[[{value}] MOD 500.5]\n#{n % 4 + 1}=[[{value}] MOD 77.3]\n" for n, value in enumerate(values)]
    program = "G21G1F9\n#1=1.5 #2=-7 #3=0 #4=100\n" + "".join(lines)
    try:
        assert agree_on(program) == len(values)
    except ProgramError as ours:
        assert ours.args[0] == "EXPRESSION_DIVISION"  # LinuxCNC continues if a ROUND or EQ swallows the "not a number"


@pytest.mark.parametrize(
    "line",
    [
        "X[1/0]", "XSQRT[-1]", "XLN[0]", "XACOS[2]", "X[[-8]**[1/3]]", "X#<no>", "X#9999", "X#0", "X#1.5", "#5420=3",
        "#<_x>=3", "X[1", "X[1FOO2]", "XFOO[1]", "#1", "#1=", "X[]", "XEXP[1000]", "X[0**-1]", "X[5MOD0]", "XATAN[1]",
        "o7 if", "o7 endif", "o7 endwhile", "o7 return", "o7 call", "o7 break", "o7 if [1] X1", "#1=#2/3",
    ],
)  # fmt: skip
def test_what_both_refuse(lib: CDLL, tmp_path: Path, line: str) -> None:
    with pytest.raises(ProgramError):
        plain_lines(lib, "G1F9\n" + line)
    with pytest.raises(Refused):
        rs274("G1F9\n" + line + "\nM2\n", tmp_path)
