"""Stack depths by hand: frames along calls, through tables, by pointers that are set elsewhere, and in a recursion."""

from __future__ import annotations

from xtensa.isr import Program, read_assembly
from xtensa.stack import RECURSIVE, Stacks

FILE = "targets/esp32/x.c"


def add(program: Program, name: str, frame: int, *names: str, file: str = FILE) -> None:
    literals = "".join(f"\t.literal .LCPI_{name}_{n}, {other}\n" for n, other in enumerate(names))
    loads = "".join(f"\tl32r\ta8, .LCPI_{name}_{n}\n\tcallx8\ta8\n" for n, _ in enumerate(names))
    head = f"\t.section\t.text.{name}\n\t.type\t{name},@function\n{name}:\n\tentry\ta1, {frame}\n"
    read_assembly(f"{literals}{head}{loads}\tretw.n\n.Lfunc_end0:\n", file, program)


def test_the_deepest_of_several_ways() -> None:
    program = Program()
    add(program, "task", 100, "shallow", "deep")
    add(program, "shallow", 500)
    add(program, "deep", 300, "deeper", "printf")
    add(program, "deeper", 300)
    way = Stacks(program, 1).deepest("task", FILE)
    assert (way.bytes, way.functions) == (700, ("task", "deep", "deeper"))


def test_a_file_calls_its_own_function_of_a_name() -> None:
    program = Program()
    add(program, "task", 100, "run")
    add(program, "run", 64)
    add(program, "run", 4000, file="core/y.c")
    assert Stacks(program, 1).deepest("task", FILE).bytes == 164


def test_functions_of_a_table_count_as_called() -> None:
    program = Program()
    add(program, "task", 100, "ops")
    add(program, "callback", 900)
    read_assembly("\t.type\tops,@object\n\t.section\t.rodata.ops\nops:\n\t.word\t0\n\t.word\tcallback\n", FILE, program)
    assert Stacks(program, 1).deepest("task", FILE).bytes == 1000


def test_what_the_hub_calls_is_the_controllers() -> None:
    program = Program()
    add(program, "net_hub_read", 1000)
    add(program, "act", 50, file="targets/esp32/app/controller.c")
    assert Stacks(program, 1).deepest("net_hub_read", FILE).bytes == 1050


def test_a_recursion_counts_as_often_as_it_may() -> None:
    program = Program()
    add(program, "task", 100, "outer")
    add(program, "outer", 40, "inner", file=RECURSIVE)
    add(program, "inner", 60, "outer", file=RECURSIVE)
    assert Stacks(program, 16).deepest("task", FILE).bytes == 100 + 16 * (40 + 60)
