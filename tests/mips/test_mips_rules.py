"""Each rule of interrupt handlers with machine code that breaks it, and the count of instructions by hand."""

from __future__ import annotations

import pytest
from mips.isr import SAVING_VECTORS, STEP_VECTORS, Program, longest_path, read_disassembly, violations

BASE = 0x9D000200
EMPTY = ("eret",)


def disassembly(functions: dict[str, tuple[str, ...]]) -> str:
    """As objdump prints it; operands may name another function: `jal f`."""
    at, addresses = BASE, {}
    for name, code in functions.items():
        addresses[name] = at
        at += 4 * len(code)
    lines = []
    for name, code in functions.items():
        lines.append(f"{addresses[name]:08x} <{name}>:")
        for index, text in enumerate(code):
            mnemonic, _, operands = text.partition(" ")
            for other, address in addresses.items():
                operands = operands.replace(f"@{other}", f"{address:08x} <{other}>")
            own = addresses[name]
            operands = operands.replace("@+", f"{own:08x}+") if "@+" in operands else operands
            if "+" in operands:
                head, _, offset = operands.rpartition("+")
                operands = f"{head[:-8]}{own + 4 * int(offset):08x} <{name}+{offset}>"
            lines.append(f"{addresses[name] + 4 * index:08x}:\t{mnemonic}\t{operands}")
    return "\n".join(lines)


def program(**functions: tuple[str, ...]) -> Program:
    every = dict.fromkeys((*STEP_VECTORS, *SAVING_VECTORS), EMPTY)
    return read_disassembly(disassembly({**every, **functions}))


def test_good_handlers_break_no_rule() -> None:
    assert violations(program()) == []


def test_a_missing_vector_is_noticed() -> None:
    assert "there is no vector _vector_step" in violations(read_disassembly(""))


@pytest.mark.parametrize(
    ("instruction", "said"),
    [
        ("mul.s f0,f1,f2", "uses floating point (mul.s)"),
        ("lwc1 f0,0(v0)", "uses floating point (lwc1)"),
        ("c.lt.d f0,f2", "uses floating point (c.lt.d)"),
        ("div zero,v0,v1", "divides (div)"),
        ("mul v0,v1,a0", "touches HI and LO, which nobody saves (mul)"),
        ("mult v0,v1", "touches HI and LO, which nobody saves (mult)"),
    ],
)
def test_float_division_and_hilo_are_refused(instruction: str, said: str) -> None:
    found = violations(program(_vector_step=("jal @work", "nop", "eret"), work=(instruction, "jr ra", "nop")))
    assert f"work() {said}" in found


def test_hilo_is_fine_where_it_is_saved() -> None:
    code = {"_vector_edge": ("jal @work", "nop", "eret"), "work": ("mul v0,v1,a0", "jr ra", "nop")}
    assert violations(program(**code)) == []


def test_a_call_by_a_pointer_is_refused() -> None:
    (found,) = violations(program(_vector_edge=("jalr ra,v0", "nop", "eret")))
    assert found == "_vector_edge() calls a pointer in v0"


def test_the_longest_path_takes_the_longer_branch_and_a_loop_once() -> None:
    code = ("beq v0,zero,@+4", "nop", "addiu v0,v0,1", "addiu v0,v0,1", "lw v0,0(a0)", "bne v0,zero,@+4", "nop", "eret")
    assert longest_path(program(_vector_step=code), "_vector_step") == 8


def test_calls_count_and_jumps_into_a_function_return_for_this_one() -> None:
    code = {
        "_vector_step": ("jal @work", "addiu sp,sp,-16", "eret"),
        "work": ("lw v0,0(a0)", "j @more", "nop"),
        "more": ("addiu v0,v0,1", "jr ra", "nop"),
    }
    assert longest_path(program(**code), "_vector_step") == 2 + 3 + 3 + 1


def test_a_way_through_a_seldom_function_does_not_count() -> None:
    code = {
        "_vector_step": ("bne v0,zero,@+3", "nop", "eret", "jal @seldom", "nop", "eret"),
        "seldom": ("addiu v0,v0,1",) * 20 + ("jr ra", "nop"),
    }
    made = program(**code)
    assert longest_path(made, "_vector_step") == 2 + 2 + 22 + 1
    assert longest_path(made, "_vector_step", ["seldom"]) == 3


def test_a_function_that_ends_in_a_jump_back_does_not_run_into_the_next() -> None:
    code = {
        "_vector_step": ("jal @work", "nop", "eret"),
        "work": ("bne v0,zero,@+4", "nop", "jr ra", "nop", "addiu v0,v0,1", "beq zero,zero,@+2", "nop"),
        "next": ("addiu v0,v0,1",) * 20 + ("jr ra", "nop"),
    }
    assert longest_path(program(**code), "_vector_step") == 2 + 2 + 3 + 2 + 1


def test_a_way_that_jumps_back_and_on_counts_in_full() -> None:
    """gcc puts rare code behind a jump, and jumps back from there: it is no loop, and nothing falls into it."""
    code = (
        "bne v0,zero,@+4", "nop", "beq zero,zero,@+8", "nop",
        "lw v0,0(a0)", "beq zero,zero,@+30", "nop", "nop",
        *("addiu v0,v0,1",) * 20, "beq zero,zero,@+4", "nop", "eret",
    )  # fmt: skip
    assert longest_path(program(_vector_step=code), "_vector_step") == 2 + 2 + 20 + 2 + 1 + 2 + 1
