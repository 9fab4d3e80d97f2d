"""Expressions: LinuxCNC's documentation in its own words, Python's evaluation of random trees, every error.

Quotes are from LinuxCNC's "G-code Overview" (docs/src/gcode/overview.adoc). What the documentation leaves open was
typed into LinuxCNC's own interpreter (`rs274`, 2.9) and is marked so.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable
from ctypes import CDLL
from dataclasses import dataclass

import pytest
from compute_bench import Bench
from gcode_core import XYZABC
from hypothesis import given
from hypothesis import strategies as st


@pytest.fixture
def bench(lib: CDLL) -> Bench:
    return Bench(lib, XYZABC)


@pytest.mark.parametrize(
    ("quote", "text", "value"),
    [
        ("An example of an expression is [1 + acos[0] - [#3 ** [4.0/2]]]", "[1 + acos[0] - [#3 ** [4.0/2]]]", 91 - 225),
        ("[2.0 / 3 * 1.5 - 5.5 / 11.0] ... which is 0.5", "[2.0 / 3 * 1.5 - 5.5 / 11.0]", 0.5),
        ("#1+2 means the number found by adding 2 to the value of parameter 1", "[#1+2]", 12),
        ("#[1+2] does mean the value found in parameter 3", "#[1+2]", 15),
        ("##2 means the value of the parameter whose index is the (integer) value of parameter 2", "##2", 15),
        ("zero is equivalent to logical false, and any non-zero number is ... true", "[2.5 AND -1]", 1),
        ("the same", "[2.5 AND 0]", 0),
        ("non-exclusive or", "[0 OR 0.1]", 1),
        ("exclusive or", "[3 XOR 2]", 0),
        ("exclusive or", "[3 XOR 0]", 1),
        ("modulus ... on any real numbers, not just on integers", "[7.5 MOD 2]", 1.5),
        ("the operation on the left is performed first", "[2 ** 3 ** 2]", 64),
        ("the operation on the left is performed first", "[10 - 3 - 2]", 5),
        ("the operation on the left is performed first", "[1 OR 0 AND 0]", 0),
        ("higher group first", "[1 + 2 * 3 ** 2]", 19),
        ("relations after sums", "[2 + 3 * 4 GT 13 AND 1]", 1),
        ("FIX rounds down", "FIX[2.8]", 2),
        ("FIX rounds toward negative: the FIX of -2.8 is -3", "FIX[-2.8]", -3),
        ("FUP rounds up: the FUP of 2.8 is 3", "FUP[2.8]", 3),
        ("and FUP of -2.8 is -2", "FUP[-2.8]", -2),
        ("ROUND to the nearest integer", "ROUND[2.4]", 2),
        ("rs274: away from zero", "ROUND[-2.5]", -3),
        ("rs274: away from zero", "ROUND[2.5]", 3),
        ("the largest double below a half is no half", "ROUND[0.49999999999999994]", 0),
        ("ATAN[arg]/[arg]: four quadrant inverse tangent", "ATAN[1]/[-1]", 135),
        ("rs274", "ATAN[0]/[0]", 0),
        ("rs274: MOD is never negative", "[-7 MOD 3]", 2),
        ("rs274: MOD is never negative", "[7 MOD -3]", 1),
        ("rs274", "[0 ** 0]", 1),
        ("rs274", "[[-8] ** 3]", -512),
        ("rs274: a sign before anything", "-[2 + 3]", -5),
        ("rs274: a sign before anything", "-#1", -10),
        ("rs274: a sign before anything", "-SQRT[4]", -2),
        ("rs274: signs in a row", "[1 - - 1]", 2),
        ("rs274: signs in a row", "[- - 1]", 1),
        ("rs274: equal within 0.0001", "[1 EQ 1.00005]", 1),
        ("rs274: equal within 0.0001", "[1 EQ 1.00015]", 0),
        ("rs274: equal within 0.0001", "[1 NE 1.00005]", 0),
        ("rs274: but not when compared otherwise", "[1 LT 1.00005]", 1),
        ("spaces mean nothing", "[ 1 2 + 3 ]", 15),
        ("upper and lower case mean the same", "aBs[-3.5]", 3.5),
    ],
)  # fmt: skip
def test_documentation(bench: Bench, quote: str, text: str, value: float) -> None:
    bench.run("#1=10", "#2=3", "#3=15")
    assert bench.value(text) == pytest.approx(value, rel=1e-15, abs=1e-15)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("SIN[0]", 0), ("SIN[30]", 0.5), ("SIN[90]", 1), ("SIN[180]", 0), ("SIN[-90]", -1), ("SIN[36000090]", 1),
        ("COS[0]", 1), ("COS[60]", 0.5), ("COS[90]", 0), ("COS[270]", 0), ("COS[-180]", -1),
        ("TAN[45]", 1), ("TAN[-45]", -1), ("TAN[180]", 0),
        ("ASIN[1]", 90), ("ASIN[-0.5]", -30), ("ACOS[1]", 0), ("ACOS[-1]", 180), ("ACOS[0.5]", 60),
        ("ATAN[1]/[0]", 90), ("ATAN[-1]/[-1]", -135), ("ATAN[0]/[-1]", 180),
        ("EXP[1]", math.e), ("EXP[0]", 1), ("LN[1]", 0), ("SQRT[2]", math.sqrt(2)),
    ],
)  # fmt: skip
def test_functions_in_degrees(bench: Bench, text: str, value: float) -> None:
    assert bench.value(text) == pytest.approx(value, rel=3e-16, abs=2e-16)


@pytest.mark.parametrize("text", ["SIN[180]", "SIN[3600000]", "COS[90]", "COS[-270]", "TAN[360]"])
def test_zeros_are_exact(bench: Bench, text: str) -> None:
    assert bench.value(text) == 0


@pytest.mark.parametrize(
    ("text", "error"),
    [
        ("", "BAD_NUMBER"),
        ("-", "BAD_NUMBER"),
        (".", "BAD_NUMBER"),
        ("[]", "BAD_NUMBER"),
        ("[1+]", "BAD_NUMBER"),
        ("[*2]", "BAD_NUMBER"),
        ("=", "BAD_NUMBER"),
        ("[1", "EXPRESSION_BRACKET"),
        ("[1+[2]", "EXPRESSION_BRACKET"),
        ("SIN 30", "EXPRESSION_BRACKET"),
        ("SIN[30", "EXPRESSION_BRACKET"),
        ("ATAN[1]", "EXPRESSION_BRACKET"),
        ("ATAN[1]/2", "EXPRESSION_BRACKET"),
        ("EXISTS[1]", "EXPRESSION_BRACKET"),
        ("EXISTS[#1", "EXPRESSION_BRACKET"),
        ("[1 FOO 2]", "EXPRESSION_OPERATOR"),
        ("[1,2]", "EXPRESSION_OPERATOR"),
        ("[1 2#1]", "EXPRESSION_OPERATOR"),
        ("FOO[1]", "EXPRESSION_OPERATOR"),
        ("[1/0]", "EXPRESSION_DIVISION"),
        ("[5 MOD 0]", "EXPRESSION_DIVISION"),
        ("SQRT[-1]", "EXPRESSION_RANGE"),
        ("LN[0]", "EXPRESSION_RANGE"),
        ("LN[-1]", "EXPRESSION_RANGE"),
        ("ACOS[2]", "EXPRESSION_RANGE"),
        ("ASIN[-1.01]", "EXPRESSION_RANGE"),
        ("TAN[90]", "EXPRESSION_RANGE"),
        ("TAN[-270]", "EXPRESSION_RANGE"),
        ("[[-8] ** [1/3]]", "EXPRESSION_RANGE"),
        ("EXP[1000]", "EXPRESSION_RESULT"),
        ("[0 ** -1]", "EXPRESSION_RESULT"),
        ("[10 ** 400]", "EXPRESSION_RESULT"),
        ("[100000000000000000 ** 20]", "EXPRESSION_RESULT"),
        ("#0", "PARAMETER_NUMBER"),
        ("#-1", "PARAMETER_NUMBER"),
        ("#1.5", "PARAMETER_NUMBER"),
        ("#9999", "PARAMETER_NUMBER"),
        ("#5003", "PARAMETER_NUMBER"),
        ("#70000", "PARAMETER_NUMBER"),
        ("#[10 ** 300]", "PARAMETER_NUMBER"),
        ("#<>", "PARAMETER_NAME"),
        ("#<name", "PARAMETER_NAME"),
        (f"#<{'n' * 32}>", "PARAMETER_NAME"),
        ("#<name>", "PARAMETER_UNSET"),
        ("#<_name>", "PARAMETER_UNSET"),
    ],
)
def test_errors(bench: Bench, text: str, error: str) -> None:
    assert bench.value(text) == error


def test_an_index_may_be_a_little_off(bench: Bench) -> None:
    """A decimal number which is intended to represent an integer is considered close enough if it is within 0.0001."""
    bench.run("#4=8")
    assert bench.value("#4.00009") == 8
    assert bench.value("#3.99991") == 8
    assert bench.value("#4.0002") == "PARAMETER_NUMBER"


@pytest.mark.parametrize(("opened", "closed"), [("[", "]"), ("-", ""), ("ABS[", "]")])
def test_depth_has_a_limit(bench: Bench, opened: str, closed: str) -> None:
    assert bench.value(opened * 15 + "1" + closed * 15) in (1, -1)
    assert bench.value(opened * 16 + "1" + closed * 16) == "EXPRESSION_DEPTH"


# Random trees, written in as few brackets as the precedence allows, against Python's own arithmetic.


@dataclass(frozen=True)
class Tree:
    """An expression: as text, and its value by Python."""

    text: str
    value: float
    rank: int  # of its outermost operator; 9 = a value


def _modulo(a: float, b: float) -> float:
    rest = math.fmod(a, b) if b else a / b
    return rest + abs(b) if rest < 0 else rest


def _logical(rule: Callable[[bool, bool], bool]) -> Callable[[float, float], float]:
    return lambda a, b: float(rule(a != 0, b != 0))


OPERATORS: dict[str, tuple[int, Callable[[float, float], float]]] = {
    "**": (5, operator.pow), "*": (4, operator.mul), "/": (4, operator.truediv), "MOD": (4, _modulo),
    "+": (3, operator.add), "-": (3, operator.sub),
    "EQ": (2, lambda a, b: float(abs(a - b) < 0.0001)), "NE": (2, lambda a, b: float(abs(a - b) >= 0.0001)),
    "GT": (2, lambda a, b: float(a > b)), "GE": (2, lambda a, b: float(a >= b)),
    "LT": (2, lambda a, b: float(a < b)), "LE": (2, lambda a, b: float(a <= b)),
    "AND": (1, _logical(lambda a, b: a and b)), "OR": (1, _logical(lambda a, b: a or b)),
    "XOR": (1, _logical(operator.ne)),
}  # fmt: skip

FUNCTIONS: dict[str, Callable[[float], float]] = {
    "ABS": abs, "FIX": math.floor, "FUP": math.ceil, "SQRT": math.sqrt, "LN": math.log,
}  # fmt: skip


def _joined(left: Tree, name: str, right: Tree) -> Tree | None:
    rank, rule = OPERATORS[name]
    if name == "**" and not (right.value in (0, 1, 2, 3) and abs(left.value) < 1e4):
        return None
    try:
        value = rule(left.value, right.value)
    except ZeroDivisionError:
        return None
    a = left.text if left.rank >= rank else f"[{left.text}]"
    b = right.text if right.rank > rank else f"[{right.text}]"
    return Tree(f"{a} {name} {b}", value, rank)


def _called(name: str, inner: Tree) -> Tree | None:
    if (name == "SQRT" and inner.value < 0) or (name == "LN" and inner.value <= 0):
        return None
    return Tree(f"{name}[{inner.text}]", FUNCTIONS[name](inner.value), 9)


LEAVES = st.integers(-9999, 9999).map(lambda n: Tree(f"{n / 100:.2f}", n / 100, 9)) | st.integers(0, 3).map(
    lambda n: Tree(str(n), float(n), 9)
)


def _grown(trees: st.SearchStrategy[Tree]) -> st.SearchStrategy[Tree]:
    joined = st.builds(_joined, trees, st.sampled_from(sorted(OPERATORS)), trees)
    called = st.builds(_called, st.sampled_from(sorted(FUNCTIONS)), trees)
    return (joined | called).filter(lambda tree: tree is not None and abs(tree.value) < 1e12)


TREES = st.recursive(LEAVES, _grown, max_leaves=7)


@given(TREES)
def test_random_trees_are_what_python_says(lib: CDLL, tree: Tree) -> None:
    """The same operations on the same doubles in the same order: the same bits, but for LN and **."""
    got = Bench(lib).value(f"[{tree.text}]")
    assert not isinstance(got, str), got
    if "LN" in tree.text or "**" in tree.text:
        if any(word in tree.text for word in ("FIX", "FUP", "MOD", "EQ", "NE", "GT", "GE", "LT", "LE")):
            return  # an ulp may tip these over
        assert got == pytest.approx(tree.value, rel=1e-9, abs=1e-9)
    else:
        assert got == tree.value


@given(st.floats(-1e6, 1e6))
def test_sine_and_cosine(lib: CDLL, angle: float) -> None:
    bench = Bench(lib)
    text = f"{angle:.6f}"
    turned = math.radians(math.fmod(float(text), 360.0))
    assert bench.value(f"SIN[{text}]") == pytest.approx(math.sin(turned), abs=2e-15)
    assert bench.value(f"COS[{text}]") == pytest.approx(math.cos(turned), abs=2e-15)


@given(st.text(alphabet="#[]<>0123456789.+-*/ABCDEFGILMNOPRSTUXQN_", max_size=79))
def test_any_text_has_an_answer(lib: CDLL, text: str) -> None:
    """A plain line that is computed is one that number_read() and the parser know: no sign, letter or bracket of ours
    is left in it."""
    bench = Bench(lib)
    if bench.answer(text) == "OK":
        assert not set("#[]<>=") & set(bench.plain(text))
