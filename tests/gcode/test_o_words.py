"""O words: LinuxCNC's documentation in its own words ("O Codes"), errors and limits, random programs against Python.

Where the documentation and LinuxCNC's interpreter (`rs274`, 2.9) differ, the interpreter is followed; that is marked.
"""

from __future__ import annotations

from collections.abc import Callable
from ctypes import CDLL
from dataclasses import dataclass, field

import pytest
from compute_bench import Bench, ProgramError
from hypothesis import given
from hypothesis import strategies as st


@pytest.fixture
def bench(lib: CDLL) -> Bench:
    return Bench(lib)


def lines(bench: Bench, text: str) -> list[str]:
    """The plain lines that a program executes."""
    return [plain for _, plain in bench.program(text)]


def failure(bench: Bench, text: str | bytes, **options: int) -> tuple[str, int]:
    """How a program ends: name of the error, line."""
    with pytest.raises(ProgramError) as caught:
        for _ in bench.program(text, **options):
            pass
    return caught.value.args


# -- the documentation's examples


def test_while_endwhile(bench: Bench) -> None:
    """(draw a sawtooth shape)"""
    text = """
        G0 X1 Y0 (move to start position)
        #1 = 0 (assign parameter #1 the value of 0)
        F25 (set a feed rate)
        o101 while [#1 LT 3]
          G1 X0
          G1 Y[#1/10] X1
          #1 = [#1+1] (increment the test counter)
        o101 endwhile
        M2 (end program)"""
    assert lines(bench, text) == [
        "G0X1Y0", "F25", "G1X0", "G1Y0X1", "G1X0", "G1Y0.1X1", "G1X0", "G1Y0.2X1", "M2",
    ]  # fmt: skip


def test_do_while(bench: Bench) -> None:
    """continue immediately skips to the next evaluation of the 'while' condition."""
    text = """
        #1 = 0 (assign parameter #1 the value of 0)
        o100 do
          X#1
          o110 if [#1 EQ 2]
            #1 = 3 (assign the value of 3 to parameter #1)
            o100 continue (skip to start of loop)
          o110 endif
          Y#1
          #1 = [#1 + 1] (increment the test counter)
        o100 while [#1 LT 3]
        Z1"""
    assert lines(bench, text) == ["X0", "Y0", "X1", "Y1", "X2", "Z1"]


@pytest.mark.parametrize(("value", "feed"), [(6, "F100"), (1, "F200"), (2, "F150"), (5, "F150")])
def test_if_elseif_else(bench: Bench, value: int, feed: str) -> None:
    """When a condition is evaluated to true no more conditions are evaluated in the group."""
    text = f"""
        #2={value}
        o102 if [#2 GT 5]
          F100
        o102 elseif [#2 LT 2]
          F200
        o102 else
          F150
        o102 endif"""
    assert lines(bench, text) == [feed]


def test_later_conditions_are_not_evaluated(bench: Bench) -> None:
    assert lines(bench, "o1 if [1]\nX1\no1 elseif [1/0]\nX2\no1 endif\nX3") == ["X1", "X3"]


@pytest.mark.parametrize("first", ["O1000", "%\nO1000 (NAME)", "N5 O0001", ":1000"])
def test_number_of_the_program(bench: Bench, first: str) -> None:
    """An O word with nothing behind its number is the program's number, and no part of it that could jump."""
    text = f"{first}\no1 sub\nX#1\no1 endsub\nO2\no1 call [5]\n%"
    assert lines(bench, text) == ["X5"]
    assert failure(bench, f"{first} X1\nG0")[0] == ("O_WORD_SYNTAX" if "O" in first else "EXPECTED_LETTER")


def test_repeat(bench: Bench) -> None:
    """repeat will execute the statements inside ... the specified number of times. rs274: rounded."""
    for count, times in (("5", 5), ("2.6", 3), ("2.4", 2), ("0.4", 0), ("0", 0), ("-3", 0)):
        assert lines(bench, f"o103 repeat [{count}]\nX1\no103 endrepeat\nY1") == ["X1"] * times + ["Y1"]


def test_repeat_counts_once(bench: Bench) -> None:
    assert lines(bench, "#1=3\no1 repeat [#1]\n#1=[#1-1]\nX#1\no1 endrepeat") == ["X2", "X1", "X0"]


def test_subroutine(bench: Bench) -> None:
    """The lines between sub and endsub are not executed until the subroutine is called."""
    text = "o100 sub\nG53 G0 X0 Y0 Z0 (rapid move to machine home)\no100 endsub\no100 call\nM2"
    assert lines(bench, text) == ["G53G0X0Y0Z0", "M2"]


def test_arguments(bench: Bench) -> None:
    """passed to the subroutine as #1, #2, ... On return ... restored to the values they had before the call.
    Subroutines can change the value of parameters above #30. rs274: the others are 0 inside."""
    text = """
        o100 sub
          X#1 Y#2 Z#3
          #1=7 #30=8 #31=9
        o100 endsub
        #1=1 #3=3
        o100 call [100] [2+3]
        X#1 Y#3 Z[#30+#31]"""
    assert lines(bench, text) == ["X100Y5Z0", "X1Y3Z9"]


def test_thirty_arguments(bench: Bench) -> None:
    text = "o1 sub\nX#1 Y#29 Z#30\no1 endsub\no1 call" + "".join(f" [{n}]" for n in range(1, 31))
    assert lines(bench, text) == ["X1Y29Z30"]
    assert failure(bench, text + "[31]") == ("O_WORD_SYNTAX", 4)


def test_return(bench: Bench) -> None:
    """This immediately returns to the calling code."""
    text = """
        o100 sub
          o110 if [#1 GT 5]
            o100 return
          o110 endif
          X#1
        o100 endsub
        o100 call [6]
        o100 call [5]"""
    assert lines(bench, text) == ["X5"]


def test_return_out_of_loops(bench: Bench) -> None:
    text = (
        "o1 sub\no2 while [1]\no3 repeat [9]\nX1\no1 return\no3 endrepeat\no2 endwhile\no1 endsub\no1 call\no1 call\nY1"
    )
    assert lines(bench, text) == ["X1", "X1", "Y1"]


def test_return_value(bench: Bench) -> None:
    """stored in #<_value>, and #<_value_returned> is set to 1; cleared just before the next subroutine call."""
    text = """
        o123 sub
          o1 if [#1 EQ 1]
            o123 return [#2 *5]
          o1 endif
        o123 endsub [3 * 4]
        o2 sub
          X#<_value> Y#<_value_returned>
        o2 endsub
        o123 call [1] [2]
        X#<_value> Y#<_value_returned>
        o123 call [0]
        X#<_value>
        o2 call
        X#<_value> Y#<_value_returned>"""
    assert lines(bench, text) == ["X10Y1", "X12", "X0Y0", "X0Y0"]


def test_recursion(bench: Bench) -> None:
    """may call themselves recursively"""
    text = """
        o<fac> sub
          #<n> = #1
          #<_value_of> = 1
          o1 if [#<n> GT 1]
            o<fac> call [#<n> - 1]
            #<_value_of> = [#<n> * #<_value>]
          o1 endif
        o<fac> endsub [#<_value_of>]
        o<Fac> call [6]
        X#<_value>"""
    assert lines(bench, text) == ["X720"]


def test_local_and_global_names(bench: Bench) -> None:
    """two subroutines can use the same parameter names; when a subroutine returns, all its local parameters are
    deleted"""
    text = """
        o1 sub
          #<a> = [10 + #<_g>]
          #<_g> = 5
          X#<a> Y[EXISTS[#<b>]]
        o1 endsub
        #<a> = 1
        #<b> = 2
        #<_g> = 3
        o1 call
        X#<a> Y#<b> Z#<_g>"""
    assert lines(bench, text) == ["X13Y0", "X1Y2Z5"]


def test_computed_label(bench: Bench) -> None:
    """o[#101+2] call"""
    text = "o5 sub\nX#1\no5 endsub\n#101=3 #<n>=5\no[#101+2] call [1]\no#<n> call [2]\no##102 call [3]"
    assert lines(bench, text.replace("##102", "[#101 + 2]")) == ["X1", "X2", "X3"]
    assert failure(bench, "#1=1\no#1 while [1]\no#1 endwhile") == ("O_WORD_SYNTAX", 2)


def test_a_subroutine_may_stand_behind_its_call(bench: Bench) -> None:
    assert lines(bench, "o1 call\nX1\no1 sub\nY1\no1 endsub\nX2") == ["Y1", "X1", "X2"]


def test_break_leaves_the_loop_of_its_label(bench: Bench) -> None:
    text = """
        #1=0
        o1 while [#1 LT 3]
          #1=[#1+1]
          o2 do
            o3 repeat [4]
              o4 if [#1 EQ 2]
                o2 break
              o4 endif
              X#1
              o3 break
            o3 endrepeat
            Y#1
          o2 while [0]
          Z#1
        o1 endwhile"""
    assert lines(bench, text) == ["X1", "Y1", "Z1", "Z2", "X3", "Y3", "Z3"]


def test_continue_in_each_loop(bench: Bench) -> None:
    text = "#1=0\no1 {begin}\n#1=[#1+1]\no2 if [#1 EQ 2]\no1 continue\no2 endif\nX#1\no1 {end}"
    for begin, end in (("while [#1 LT 3]", "endwhile"), ("do", "while [#1 LT 3]"), ("repeat [3]", "endrepeat")):
        assert lines(bench, text.format(begin=begin, end=end)) == ["X1", "X3"]


def test_conditions_see_what_lines_did(bench: Bench) -> None:
    text = "G0 X0\no1 while [#<_x> LT 3]\nG91 G0 X1\no1 endwhile"
    assert lines(bench, text) == ["G0X0", *["G91G0X1"] * 3]


# -- the text


def test_line_numbers(bench: Bench) -> None:
    text = "(one)\r\n\r\no1 repeat [2]\rX1 ; two\n\no1 endrepeat\n% seven\nN70 X#<_line>"
    assert list(bench.program(text)) == [(4, "X1"), (4, "X1"), (8, "N70X8")]


def test_what_is_left_out(bench: Bench) -> None:
    """As in a stream: comments, blanks, a byte order mark, a slash outside of computed lines; and lines with %."""
    text = b"%\n\xef\xbb\xbfg0 x1 (a; [ # ) y2\n/x3 ; o1 sub\nx[6/2] (\xc3\xa4)\n%x9\n(o1 sub)\n\x1a"
    assert [plain for _, plain in bench.program(text)] == ["G0X1Y2", "X3", "X3"]


def test_an_o_line_may_have_a_line_number_and_a_comment(bench: Bench) -> None:
    assert lines(bench, "N10 O1 REPEAT [2] (twice)\nN20X1\nN30o1endrepeat;") == ["N20X1"] * 2


def test_long_lines(bench: Bench) -> None:
    """256 characters without blanks and comments."""
    sum_of = "+".join(["1"] * 126)
    assert lines(bench, f"X[{sum_of}] {' ' * 400} ({'c' * 400})") == ["X126"]
    assert len(f"X[{sum_of}]") == 254
    assert lines(bench, f"X[00{sum_of}] ") == ["X126"]
    assert failure(bench, f"\nX[{sum_of}+1+1]") == ("LINE_TOO_LONG", 2)


@pytest.mark.parametrize("size", [127, 128, 129, 255, 256, 257])
def test_line_ends_at_the_border_of_a_chunk(bench: Bench, size: int) -> None:
    for end in ("\n", "\r", "\r\n"):
        text = f"({'c' * (size - 2 - len(end))}){end}X#<_line>{end}o1 repeat [2]{end}Y#<_line>{end}o1 endrepeat"
        assert list(bench.program(text)) == [(2, "X2"), (4, "Y4"), (4, "Y4")]


def test_a_text_that_cannot_be_read(bench: Bench) -> None:
    text = "X1\n" * 100
    assert failure(bench, text, fails_at=200)[0] == "PROGRAM_READ"
    running = bench.program(text)
    next(running)
    bench._lib.bench_fail_at(bench._bench, 200)
    with pytest.raises(ProgramError) as caught:
        list(running)
    assert caught.value.args[0] == "PROGRAM_READ"


def test_an_empty_program(bench: Bench) -> None:
    for text in ("", "\n", "%", "(nothing)", "\n\n\r\n"):
        assert lines(bench, text) == []


# -- errors and limits


@pytest.mark.parametrize(
    ("text", "error", "line"),
    [
        ("X1\no1 foo", "O_WORD_SYNTAX", 2),
        ("o1 if [1] X1\no1 endif", "O_WORD_SYNTAX", 1),
        ("o1 if\no1 endif", "O_WORD_SYNTAX", 1),
        ("o1 if 1\no1 endif", "O_WORD_SYNTAX", 1),
        ("o1 while\no1 endwhile", "O_WORD_SYNTAX", 1),
        ("o1 repeat\no1 endrepeat", "O_WORD_SYNTAX", 1),
        ("o1 do [1]\no1 while [0]", "O_WORD_SYNTAX", 1),
        ("o1 sub [1]\no1 endsub", "O_WORD_SYNTAX", 1),
        ("o1 sub\no1 endsub\no1 call 5", "O_WORD_SYNTAX", 3),
        ("o1 sub\no1 endsub\no1 call [5] 6", "O_WORD_SYNTAX", 3),
        ("o<name sub", "O_WORD_SYNTAX", 1),
        ("o<> sub", "O_WORD_SYNTAX", 1),
        (f"o<{'n' * 32}> sub", "O_WORD_SYNTAX", 1),
        ("o sub", "O_WORD_SYNTAX", 1),
        ("o-1 sub", "O_WORD_SYNTAX", 1),
        ("o99999999999 sub", "O_WORD_SYNTAX", 1),
        ("X1 o1 sub\no1 endsub", "O_WORD_UNMATCHED", 2),
        ("X1\nX1 o1 if [1]", "O_WORD", 2),
        ("o[-1] call", "O_WORD_SYNTAX", 1),
        ("o[1.5] call", "O_WORD_SYNTAX", 1),
        ("o[1/0] call", "EXPRESSION_DIVISION", 1),
        ("X1\no1 if [1/0]\no1 endif", "EXPRESSION_DIVISION", 2),
        ("o1 if [0]\nX1\no1 elseif [1/0]\no1 endif", "EXPRESSION_DIVISION", 3),
        ("X1\no1 if [1]\nX2", "O_WORD_UNMATCHED", 2),
        ("X1\no1 if [0]\nX2", "O_WORD_UNMATCHED", 2),
        ("o1 if [1]\no2 endif", "O_WORD_UNMATCHED", 2),
        ("o1 endif", "O_WORD_UNMATCHED", 1),
        ("o1 else", "O_WORD_UNMATCHED", 1),
        ("o1 elseif [1]", "O_WORD_UNMATCHED", 1),
        ("o1 while [1]\nX1", "O_WORD_UNMATCHED", 1),
        ("o1 while [0]\nX1", "O_WORD_UNMATCHED", 1),
        ("o1 endwhile", "O_WORD_UNMATCHED", 1),
        ("X1\no1 do\nX1", "O_WORD_UNMATCHED", 2),
        ("o1 repeat [0]\nX1", "O_WORD_UNMATCHED", 1),
        ("o1 endrepeat", "O_WORD_UNMATCHED", 1),
        ("o1 repeat [5]\no1 endwhile", "O_WORD_UNMATCHED", 2),
        ("o1 repeat [5]\no2 if [1]\no1 endrepeat\no2 endif", "O_WORD_UNMATCHED", 3),
        ("o1 repeat [10**10]\no1 endrepeat", "EXPRESSION_RESULT", 1),
        ("o1 break", "O_WORD_UNMATCHED", 1),
        ("o1 continue", "O_WORD_UNMATCHED", 1),
        ("o1 if [1]\no1 break\no1 endif", "O_WORD_UNMATCHED", 2),
        ("o1 while [1]\no2 break\no1 endwhile", "O_WORD_UNMATCHED", 2),
        ("o1 return", "O_WORD_UNMATCHED", 1),
        ("o1 endsub", "O_WORD_UNMATCHED", 1),
        ("X1\no1 sub\nX1", "O_WORD_UNMATCHED", 2),
        ("o1 sub\no2 sub\no2 endsub\no1 endsub", "O_WORD_UNMATCHED", 2),
        ("o1 sub\no2 endsub", "O_WORD_UNMATCHED", 2),
        ("o1 sub\no2 if [1]\no1 endsub\no1 call", "O_WORD_UNMATCHED", 2),
        ("o1 sub\no2 if [0]\no1 endsub\no2 endif\no1 call", "O_WORD_UNMATCHED", 4),
        ("o1 if [1]\no2 sub\no2 endsub\no1 endif", "O_WORD_UNMATCHED", 2),
        ("o1 sub\no2 break\no1 endsub\no2 while [1]\no1 call\no2 endwhile", "O_WORD_UNMATCHED", 2),
        ("o1 call", "SUB_UNKNOWN", 1),
        ("o<nobody> call", "SUB_UNKNOWN", 1),
        ("o1 sub\no1 endsub\no1 sub\no1 endsub", "SUB_REPEATED", 3),
        ("o1 sub\no1 endsub\no001 sub\no1 endsub", "SUB_REPEATED", 3),
        ("X1\nG999", "UNSUPPORTED", 2),
        ("#1=[1/0]", "EXPRESSION_DIVISION", 1),
    ],
)
def test_errors(bench: Bench, text: str, error: str, line: int) -> None:
    assert failure(bench, text) == (error, line)


def test_nested_calls_have_a_limit(bench: Bench) -> None:
    text = "o1 sub\nX#1\no2 if [#1 LT {deep}]\no1 call [#1+1]\no2 endif\no1 endsub\no1 call [1]"
    assert len(lines(bench, text.format(deep=10))) == 10
    assert failure(bench, text.format(deep=11)) == ("PROGRAM_DEPTH", 4)


def test_nested_blocks_have_a_limit(bench: Bench) -> None:
    def nested(count: int) -> str:
        opened = "".join(f"o{n} if [1]\n" for n in range(count))
        return opened + "X1\n" + "".join(f"o{n} endif\n" for n in reversed(range(count)))

    assert lines(bench, nested(32)) == ["X1"]
    assert failure(bench, nested(33)) == ("PROGRAM_DEPTH", 33)


def test_subroutines_have_a_limit(bench: Bench) -> None:
    text = "".join(f"o{n} sub\nX{n}\no{n} endsub\n" for n in range(64))
    assert lines(bench, text + "o63 call\no0 call") == ["X63", "X0"]
    assert failure(bench, text + "o64 sub\no64 endsub") == ("SUB_ROOM", 193)


def test_endless_loops_end(bench: Bench) -> None:
    assert failure(bench, "X1\no1 while [1]\n#1=[#1+1]\no1 endwhile", lines_max=1000) == ("PROGRAM_ENDLESS", 2)
    assert bench.value("#1") == 333
    assert lines(bench, "X1\nX2\nX3") == ["X1", "X2", "X3"]
    assert [plain for _, plain in bench.program("X1\nX2", lines_max=2)] == ["X1", "X2"]


def test_what_is_local_is_gone_after_a_call_whatever_happens_in_it(bench: Bench) -> None:
    sub = "o1 sub\n#<a>=1\no2 repeat [3]\no1 return\no2 endrepeat\no1 endsub\n"
    assert lines(bench, sub + "o3 repeat [100]\no1 call\no3 endrepeat\nX#<_call_level>") == ["X0"]


# -- random programs, written twice: as O words, and as what Python does


@dataclass
class Maker:
    """Writes O words and makes the trace that they must leave."""

    text: list[str] = field(default_factory=list)
    labels: int = 0

    def label(self) -> int:
        self.labels += 1
        return self.labels


Act = Callable[[list[str], dict[int, int]], None]


@st.composite
def programs(draw: st.DrawFn, maker: Maker, depth: int, in_loop: bool) -> Act:
    """A few statements: their text goes to the maker, and what they do is returned."""
    acts = [draw(statement(maker, depth, in_loop)) for _ in range(draw(st.integers(1, 3)))]

    def run(trace: list[str], values: dict[int, int]) -> None:
        for act in acts:
            act(trace, values)

    return run


@st.composite
def statement(draw: st.DrawFn, maker: Maker, depth: int, in_loop: bool) -> Act:
    kinds = ["move", "add"] + (["if", "repeat", "while"] if depth > 0 else [])
    kind = draw(st.sampled_from(kinds))
    number, value = draw(st.integers(1, 4)), draw(st.integers(0, 3))
    if kind == "move":
        maker.text.append(f"X#{number}")
        return lambda trace, values: trace.append(f"X{values[number]}")
    if kind == "add":
        maker.text.append(f"#{number} = [#{number} + {value}]")
        return lambda _trace, values: values.update({number: values[number] + value})
    label = maker.label()
    if kind == "if":
        return draw(branches(maker, depth, in_loop, label, number, value))
    return draw(loops(maker, depth, kind, label, number, value))


@st.composite
def branches(draw: st.DrawFn, maker: Maker, depth: int, in_loop: bool, label: int, number: int, value: int) -> Act:
    maker.text.append(f"o{label} if [#{number} GT {value}]")
    first = draw(programs(maker, depth - 1, in_loop))
    maker.text.append(f"o{label} elseif [#{number} EQ {value}]")
    second = draw(programs(maker, depth - 1, in_loop))
    maker.text.append(f"o{label} else")
    third = draw(programs(maker, depth - 1, in_loop))
    maker.text.append(f"o{label} endif")

    def run(trace: list[str], values: dict[int, int]) -> None:
        now = values[number]
        (first if now > value else second if now == value else third)(trace, values)

    return run


@st.composite
def loops(draw: st.DrawFn, maker: Maker, depth: int, kind: str, label: int, number: int, value: int) -> Act:
    counter = 40 + label  # its own, so that every loop ends
    begin, end = (
        (f"repeat [{value}]", "endrepeat") if kind == "repeat" else (f"while [#{counter} LT {value}]", "endwhile")
    )
    leaves_at = draw(st.integers(1, 4))
    maker.text += [f"#{counter} = 0", f"o{label} {begin}", f"#{counter} = [#{counter} + 1]"]
    body = draw(programs(maker, depth - 1, True))
    word = draw(st.sampled_from(["break", "continue"]))
    inner = maker.label()
    maker.text += [f"o{inner} if [#{counter} EQ {leaves_at}]", f"o{label} {word}", f"o{inner} endif"]
    rest = draw(programs(maker, depth - 1, True))
    maker.text.append(f"o{label} {end}")

    def run(trace: list[str], values: dict[int, int]) -> None:
        for turn in range(1, value + 1):
            body(trace, values)
            if turn == leaves_at and word == "break":
                return
            if turn != leaves_at:
                rest(trace, values)

    return run


@given(st.data())
def test_random_programs_do_what_python_does(lib: CDLL, data: st.DataObject) -> None:
    maker = Maker()
    act = data.draw(programs(maker, 3, False))
    trace: list[str] = []
    act(trace, dict.fromkeys(range(1, 5), 0))
    bench = Bench(lib)
    if maker.labels > 20:
        return  # more parameters than there is room for
    assert lines(bench, "\n".join(maker.text)) == trace


# -- M73


def test_m73_restores_when_the_subroutine_returns(bench: Bench) -> None:
    """`restore state on subroutine endsub or any return path`"""
    text = """
        o1 sub
          M73 G91
          o2 if [#1 GT 0]
            o1 return
          o2 endif
          G20
        o1 endsub
        o1 call [1]
        X1
        o1 call
        X2"""
    assert lines(bench, text) == ["M73G91", "M72", "X1", "M73G91", "G20", "M72", "X2"]


def test_m73_in_the_main_program_is_m70(bench: Bench) -> None:
    """`the normal end (M2) of a main program which contains an M73 will not restore the state`"""
    assert lines(bench, "M73G91\no1 sub\nX1\no1 endsub\no1 call\nM72") == ["M73G91", "X1", "M72"]


@pytest.mark.parametrize("inner", ["M70", "M71", "M73"])
def test_what_m73_saved_was_saved_over(bench: Bench, inner: str) -> None:
    """LinuxCNC has a place for each call; a controller has one."""
    program = f"o1 sub\n{inner}\no1 endsub\no2 sub\nM73\no1 call\no2 endsub\no2 call\n"
    assert failure(bench, program) == ("SAVED_OVER", 7)
    assert lines(bench, f"o1 sub\n{inner}\no1 endsub\no2 sub\nM73\no2 endsub\no2 call\no1 call\no2 call")


@pytest.mark.parametrize("label", ["o1", "o<t>", "o77", "o#1"])
def test_the_label_of_return_is_not_compared(bench: Bench, label: str) -> None:
    """As in LinuxCNC: that of the block around it will do."""
    text = f"o<t> sub\no1 if [#1 GT 0]\nX5\n{label} return [7]\no1 endif\nX9\no<t> endsub\no<t> call [1]\nX#<_value>"
    if label == "o#1":  # a computed label is of a call
        text = text.replace(label, "o<else>")
    assert [line for _, line in bench.program(text)] == ["X5", "X7"]


def test_task_says_that_a_machine_moves(bench: Bench) -> None:
    assert [line for _, line in bench.program("o1 if [#<_task> EQ 1]\nX1\no1 endif")] == ["X1"]
