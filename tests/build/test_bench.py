"""The benchmark's reading of callgrind, and its budgets on instructions where valgrind is."""

from __future__ import annotations

import pytest
from bench.callgrind import parse_callgrind
from bench.measure import Figure

OUT = """\
# callgrind format
positions: line
events: Ir

fl=(1) /x/core/step/isr.c
fn=(1) step_isr
10 5
+2 7
fi=(2) /x/targets/pc/hal/hal_step.h
3 8
fe=(1)
cfi=(3) /x/targets/sim/trace.c
cfn=(2) trace_flush
calls=2 4
12 30
* 1

fl=(4) /x/core/motion/planner.c
fn=(3) run
1 100
cob=(1) /lib/libm.so
cfi=(5) ./fminf.S
cfn=(4) fminf
calls=3 0
2 9
cfi=(1)
cfn=(1)
calls=1 10
3 50

fn=(5) helper
7 20

fl=(6) /x/core/input/text.c
fn=(3)
1 1000

fl=(5)
fn=(4)
0 9
"""


def test_cost_of_a_function_counts_its_inlined_code() -> None:
    profile = parse_callgrind(OUT.splitlines())
    assert profile.self_cost["/x/core/step/isr.c", "step_isr"] == 5 + 7 + 8 + 1


def test_inclusive_cost_counts_calls() -> None:
    assert parse_callgrind(OUT.splitlines()).inclusive("step_isr") == 21 + 30


def test_room_counts_its_functions_and_the_library_but_no_other_room() -> None:
    profile = parse_callgrind(OUT.splitlines())
    assert profile.room("core/motion/planner.c") == 100 + 20 + 9
    assert profile.room("core/input/") == 1000  # a static function of the same name in another file is another function


@pytest.mark.parametrize(
    ("value", "limit", "at_least", "met"),
    [(5, None, False, True), (5, 5, False, True), (6, 5, False, False), (5, 5, True, True), (4, 5, True, False)],
)
def test_budget(value: float, limit: float | None, at_least: bool, met: bool) -> None:
    assert Figure("x", value, "instr", limit, at_least).is_met is met
