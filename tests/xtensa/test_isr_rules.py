"""Each rule of interrupt handlers with assembly that breaks it, and the count of instructions by hand."""

from __future__ import annotations

import pytest
from xtensa.isr import (
    PANIC_CALLS,
    STEP,
    Program,
    in_flash,
    longest_path,
    panic_violations,
    placed_in_ram,
    violations,
)


def read(*functions: str, file: str = "targets/esp32/x.c") -> Program:
    from xtensa.isr import read_assembly

    program = Program()
    read_assembly("\n".join(functions), file, program)
    return program


def function(name: str, body: str, section: str = ".iram1.0", literals: str = "") -> str:
    lines = "\n".join(f"\t{line.strip()}" if not line.strip().startswith(".LBB") else line for line in body.split(";"))
    return (
        f'{literals}\t.section\t{section},"ax",@progbits\n\t.type\t{name},@function\n{name}:\n{lines}\n.Lfunc_end0:\n'
    )


GOOD = function("handler", "entry\ta1, 32;retw.n")


def faults(program: Program, *placed: str) -> list[str]:
    return violations(program, placed, ["handler"])


def test_a_good_handler_breaks_no_rule() -> None:
    assert faults(read(GOOD)) == []


def test_a_missing_handler_is_noticed() -> None:
    assert faults(read("")) == ["there is no handler handler()"]


@pytest.mark.parametrize(
    ("body", "said"),
    [
        ("entry\ta1, 32;mul.s\tf0, f1, f2;retw.n", "floating point (mul.s)"),
        ("entry\ta1, 32;quou\ta2, a3, a4;retw.n", "divides (quou)"),
        ("entry\ta1, 32;callx8\ta8;retw.n", "a pointer in a8"),
    ],
)
def test_float_division_and_pointers_are_refused(body: str, said: str) -> None:
    (fault,) = faults(read(function("handler", body)))
    assert said in fault


def step_faults(body: str, *others: str) -> list[str]:
    return violations(read(function(STEP, body), *others), (), [STEP])


@pytest.mark.parametrize("word", ["entry\ta1, 32", "call8\tstep", "loopnez\ta2, .LBB0_1", "mula.aa.ll\ta2, a3"])
def test_what_the_vector_calls_uses_only_what_it_saves(word: str) -> None:
    assert step_faults("addi\ta1, a1, -16;ret") == []
    assert any("which the vector does not save" in fault for fault in step_faults(f"{word};ret"))


def test_what_the_vector_calls_is_called_by_nobody_else() -> None:
    isr = function("isr", "addi\ta2, a2, 1;ret")
    assert step_faults("call0\tisr;ret", isr) == []
    other = function("task", "entry\ta1, 32;call8\tisr;retw.n")
    (fault,) = step_faults("call0\tisr;ret", isr, other)
    assert "isr() is called by task()" in fault


def test_what_the_vector_calls_calls_no_library() -> None:
    (fault,) = step_faults("call0\tmemcpy;ret")
    assert "memcpy, which is not allowed" in fault


def test_a_call_through_a_literal_is_followed() -> None:
    caller = function(
        "handler", "entry\ta1, 32;l32r\ta8, .LCPI0_0;callx8\ta8;retw.n", literals="\t.literal .LCPI0_0, printf\n"
    )
    assert faults(read(caller)) == ["targets/esp32/x.c: handler() calls printf, which is not allowed"]
    other = function("printf", "entry\ta1, 32;retw.n", section=".text.printf")
    assert faults(read(caller, other)) == ["targets/esp32/x.c: printf() lies in flash (.text.printf)"]
    assert faults(read(caller, other), "targets:x") == []
    assert faults(read(caller, other), "targets:x:printf") == []


def test_constants_in_flash_are_noticed_unless_the_object_is_placed() -> None:
    table = "\t.type\ttable,@object\n\t.section\t.rodata.table\ntable:\n"
    reader = function("handler", "entry\ta1, 32;l32r\ta8, .LCPI0_0;retw.n", literals="\t.literal .LCPI0_0, table\n")
    assert faults(read(table, reader)) == ["targets/esp32/x.c: handler() reads table in flash"]
    assert faults(read(table, reader), "targets:x") == []


def test_the_longest_path_takes_the_longer_branch_and_a_loop_once() -> None:
    body = """entry\ta1, 32;beqz\ta2, .LBB0_2;addi\ta3, a3, 1;addi\ta3, a3, 1;
.LBB0_2:;addi\ta4, a4, 1;bnez\ta4, .LBB0_2;retw.n"""
    assert longest_path(read(function("handler", body)), "handler") == 7


def test_a_path_with_an_excluded_call_does_not_count() -> None:
    body = "entry\ta1, 32;beqz\ta2, .LBB0_2;call8\tseldom;j\t.LBB0_3;\n.LBB0_2:;nop;\n.LBB0_3:;retw.n"
    program = read(function("handler", body), function("seldom", "entry\ta1, 32;nop;nop;nop;retw.n"))
    assert longest_path(program, "handler") == 2 + 2 + 5 + 1
    assert longest_path(program, "handler", ["seldom"]) == 4


def test_a_shared_call_goes_where_each_way_came_from() -> None:
    body = """entry\ta1, 32;beqz\ta2, .LBB0_2;l32r\ta8, .LCPI0_0;j\t.LBB0_3;
.LBB0_2:;nop;l32r\ta8, .LCPI0_1;
.LBB0_3:;callx8\ta8;retw.n"""
    literals = "\t.literal .LCPI0_0, short\n\t.literal .LCPI0_1, long\n"
    program = read(
        function("handler", body, literals=literals),
        function("short", "entry\ta1, 32;retw.n"),
        function("long", "entry\ta1, 32;nop;nop;nop;retw.n"),
    )
    assert program.functions["handler"].calls == {"short", "long"}
    assert longest_path(program, "handler") == 2 + 2 + 2 + 5
    assert longest_path(program, "handler", ["long"]) == 2 + 2 + 2 + 2


@pytest.mark.parametrize("last", ["addi\ta8, a8, 4", "call8\tother"])
def test_a_register_that_was_overwritten_is_no_function_any_more(last: str) -> None:
    body = f"entry\ta1, 32;l32r\ta8, .LCPI0_0;{last};callx8\ta8;retw.n"
    caller = function("handler", body, literals="\t.literal .LCPI0_0, other\n")
    other = function("other", "entry\ta1, 32;retw.n")
    assert any("a pointer in a8" in fault for fault in faults(read(caller, other)))


def test_linker_fragments_are_read() -> None:
    text = (
        "[mapping:x]\narchive: libx.a\nentries:\n    isr (noflash)\n    machine:place (noflash)\n    other (default)\n"
    )
    assert placed_in_ram(text, "core") == {"core:isr", "core:machine:place"}


def test_what_a_round_of_the_motion_task_takes_from_flash_is_noticed() -> None:
    program = read(
        function("round", "entry\ta1, 32;call8\twork;call8\trare;call8\tplaced;retw.n"),
        function("work", "entry\ta1, 32;retw.n", ".text.work"),
        function("rare", "entry\ta1, 32;call8\tof_rare;retw.n", ".text.rare"),
        function("of_rare", "entry\ta1, 32;retw.n", ".text.of_rare"),
        function("placed", "entry\ta1, 32;retw.n", ".text.placed"),
        file="core/x.c",
    )
    assert in_flash(program, ["core:x:placed"], "round", ["rare"]) == ["core/x.c: work() lies in flash (.text.work)"]
    assert in_flash(program, ["core:x"], "round", ()) == []
    assert in_flash(program, ["core:x"], "other", ()) == ["there is no other()"]


def panic(*others: str) -> list[str]:
    calls = ";".join(f"call8\t{name}" for name in (*PANIC_CALLS, "callee"))
    table = "\t.type\ttable,@object\n\t.section\t.rodata.table\ntable:\n"
    root = function("panic", f"entry\ta1, 32;{calls};retw.n")
    return panic_violations(read(table, root, *others), (), ["panic"])


def test_a_panic_calls_and_reads_nothing_in_flash() -> None:
    assert panic(function("callee", "entry\ta1, 32;retw.n")) == []
    assert panic(function("callee", "entry\ta1, 32;retw.n", ".text.callee")) == [
        "targets/esp32/x.c: callee() lies in flash (.text.callee)"
    ]
    assert panic() == ["targets/esp32/x.c: panic() calls callee, which is not allowed"]
    literals = "\t.literal .LCPI0_0, table\n"
    reader = function("callee", "entry\ta1, 32;l32r\ta8, .LCPI0_0;retw.n", literals=literals)
    assert panic(reader) == ["targets/esp32/x.c: callee() reads table in flash"]
    assert panic_violations(read(), (), ["panic"]) == ["there is no panic()"]
