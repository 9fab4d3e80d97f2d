"""What the machine code of the interrupt handlers says: where everything lies that they reach, what they call, and how
many instructions their longest path has.

Read from the assembly text of the compiler (one instruction a line, calls through literals), not from measurements.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

# What the vector of the step timer's level calls (targets/esp32/hal/step_vector.S), and what ESP-IDF calls.
STEP = "step_interrupt"
ROOTS = (STEP, "on_edge", "on_switch_timer")
VECTOR = Path("targets/esp32/hal/step_vector.S")
BEFORE_VECTOR = 2  # instructions in ESP-IDF's own: a0 to EXCSAVE_5, and the call

# What the motion task calls every ms, and of that what it calls only when motors are switched or motion starts.
MOTION = "machine_poll_motion"
RARE_IN_MOTION = ("hal_motors_set", "hal_time_us")

# What the step interrupt does only when a span ends, while it looks for the probe, or each time the counter wraps.
SELDOM = ("next_span", "put_probing_event", "step_alarm_wraps")

# Outside of our code: in the chip's ROM, or in IRAM by ESP-IDF (esp_timer.c marks it so). Instructions of a call, for
# the longest path: memcpy of a span's 72 bytes by words.
ALLOWED_CALLS = {"memcpy": 60, "memset": 60, "esp_timer_get_time": 60}

# What ESP-IDF's panic handler calls first, by --wrap, and a restart by software (main/panic.c).
PANIC = ("__wrap_esp_panic_handler", "switch_off")

# Of ESP-IDF, in that path: in the chip's ROM; in IRAM by CONFIG_ESP_SYSTEM_IN_IRAM (its default) and by
# CONFIG_GPIO_CTRL_FUNC_IN_IRAM; and its own handler, when the outputs are off.
PANIC_CALLS = (
    *("memcpy", "memset", "esp_rom_gpio_connect_out_signal", "esp_rom_delay_us"),
    *("esp_backtrace_get_next_frame", "gpio_set_level"),
    "__real_esp_panic_handler",
)

# What the vector does not save, and so what it calls must not touch: the window, loop registers, the accumulator.
UNSAVED = re.compile(r"^(entry|retw(\.n)?|callx?(4|8|12)|movsp|rotw|loop\w*|mul[as]\b.*|mul[as]\.\S+|umul\.\S+)$")
FLOAT = re.compile(r"^(\w+\.s|lsi|ssi|lsx|ssx|rfr|wfr)$")
DIVISION = ("quos", "quou", "rems", "remu")
BRANCH = re.compile(r"^(b\w+|j|loop\w*)$")
ENDS = ("j", "jx", "ret", "ret.n", "retw", "retw.n")
STORE = re.compile(r"^s(8|16|32)")  # the first operand is not a target
TAKEN_BY_CALLS = tuple(f"a{n}" for n in range(8, 16))  # the callee's window


@dataclass(frozen=True)
class Sets:
    """A register gets a new value: a symbol's address, or "" for anything else."""

    register: str
    symbol: str


@dataclass(frozen=True)
class Call:
    """A call of a function by name or by what a register holds."""

    target: str


@dataclass
class Block:
    """Instructions without a branch between them."""

    count: int = 0
    steps: list[Sets | Call] = field(default_factory=list)
    next: set[str] = field(default_factory=set)

    def calls(self, registers: dict[str, str]) -> tuple[list[str], dict[str, str]]:
        """Whom it calls when it begins with these symbols in registers, and what they hold behind it."""
        held, called = dict(registers), []
        for step in self.steps:
            if isinstance(step, Sets):
                held[step.register] = step.symbol
            else:
                is_register = re.fullmatch(r"a\d+", step.target)
                called.append(held.get(step.target) or f"a pointer in {step.target}" if is_register else step.target)
                held = {name: symbol for name, symbol in held.items() if name not in TAKEN_BY_CALLS}
        return called, {name: symbol for name, symbol in held.items() if symbol}


@dataclass
class Function:
    """A function as the compiler wrote it."""

    name: str
    file: str  # of the source, within the repository
    section: str
    frame: int = 0  # bytes of stack
    blocks: dict[str, Block] = field(default_factory=dict)
    mnemonics: set[str] = field(default_factory=set)
    symbols: set[str] = field(default_factory=set)  # data and functions that its literals name

    @property
    def calls(self) -> set[str]:
        """All whom it may call, on any way through it."""
        found: set[str] = set()
        waiting: list[tuple[str, dict[str, str]]] = [(self.name, {})]
        seen: set[tuple[str, frozenset[tuple[str, str]]]] = set()
        while waiting:
            label, registers = waiting.pop()
            if label in self.blocks and (key := (label, frozenset(registers.items()))) not in seen:
                seen.add(key)
                called, held = self.blocks[label].calls(registers)
                found |= set(called)
                waiting += [(following, held) for following in self.blocks[label].next]
        return found


@dataclass
class Program:
    """All functions, and the section of every data symbol."""

    functions: dict[str, Function] = field(default_factory=dict)
    data: dict[str, str] = field(default_factory=dict)
    every: list[Function] = field(default_factory=list)  # also those of one name in several files
    tables: dict[str, set[str]] = field(default_factory=dict)  # data symbol -> functions and data that it names


def read_assembly(text: str, file: str, program: Program) -> None:
    """Add one file's functions and data to the program. Local names get the file's, as they mean nothing elsewhere."""
    reader = _Reader(file, program)
    for line in text.splitlines():
        reader.take(line.split("#")[0].rstrip())


class _Reader:
    """Goes through the lines of one file."""

    def __init__(self, file: str, program: Program) -> None:
        self.file = file
        self.program = program
        self.section = ".text"
        self.literals: dict[str, str] = {}
        self.kinds: dict[str, str] = {}
        self.function: Function | None = None
        self.block = Block()
        self.table = ""

    def take(self, line: str) -> None:
        if match := re.match(r"\s*\.literal (\S+), (\S+)", line):
            self.literals[match[1]] = match[2]
        elif match := re.match(r"\s*\.section\s+([^,\s]+)|\s*(\.text|\.data|\.bss)$", line):
            self.section = match[1] or match[2]
        elif match := re.match(r"\s*\.type\s+([^,]+),[@%](\w+)", line):
            self.kinds[match[1]] = match[2]
        elif match := re.match(r"([\w.$]+):", line):
            self._label(match[1])
        elif match := re.match(r"\s*\.(?:word|long|4byte)\s+([A-Za-z_.][\w.]*)", line):
            self.program.tables.setdefault(self.table, set()).add(match[1])
        elif self.function and re.match(r"\t[a-z]", line):
            self._instruction(line.split())

    def _label(self, name: str) -> None:
        if self.kinds.get(name) == "function":
            self.function = Function(name, self.file, self.section)
            self.program.functions[name] = self.function
            self.program.every.append(self.function)
            self.block = self.function.blocks[name] = Block()
        elif name.startswith(".Lfunc_end"):
            self.function = None
        elif self.function and name.startswith(".LBB"):
            self.block.next.add(name)
            self.block = self.function.blocks[name] = Block()
        elif self.kinds.get(name) == "object":
            self.table = f"{self.file}:{name}" if name.startswith(".L") else name
            self.program.data[self.table] = self.section

    def _instruction(self, words: list[str]) -> None:
        assert self.function
        mnemonic, operands = words[0], [word.rstrip(",") for word in words[1:]]
        self.function.mnemonics.add(mnemonic)
        self.block.count += 1
        if mnemonic == "entry":
            self.function.frame = int(operands[1])
        elif mnemonic == "addi" and operands[1] == "a1" and operands[2].startswith("-"):  # of the call0 ABI
            self.function.frame = -int(operands[2])
        if mnemonic == "l32r":
            symbol = self.literals.get(operands[1], operands[1])
            self.block.steps.append(Sets(operands[0], symbol))
            self.function.symbols.add(f"{self.file}:{symbol}" if symbol.startswith(".L") else symbol)
        elif mnemonic.startswith("call"):
            self.block.steps.append(Call(operands[0]))
        elif operands and not BRANCH.match(mnemonic) and not STORE.match(mnemonic):
            self.block.steps.append(Sets(operands[0], ""))
        if BRANCH.match(mnemonic) or mnemonic in ENDS:
            self._end_block(mnemonic, operands)

    def _end_block(self, mnemonic: str, operands: list[str]) -> None:
        assert self.function
        if operands and operands[-1].startswith(".LBB"):
            self.block.next.add(operands[-1])
        following = Block()
        name = f"{self.function.name}+{len(self.function.blocks)}"
        if mnemonic not in ENDS:
            self.block.next.add(name)
        self.function.blocks[name] = following
        self.block = following


# ---- judgement ----


def reachable(program: Program, roots: Iterable[str], without: Iterable[str] = ()) -> set[str]:
    """Every function that a handler can come to. @param without  these and what they alone call are left out"""
    found: set[str] = set()
    excluded = set(without)
    waiting = [root for root in roots if root in program.functions]
    while waiting:
        name = waiting.pop()
        if name not in found and name in program.functions and name not in excluded:
            found.add(name)
            waiting += program.functions[name].calls
    return found


def placed_in_ram(fragment: str, folder: str) -> set[str]:
    """The entries of a linker.lf: "folder:object" or "folder:object:function" for each (noflash)."""
    return {f"{folder}:{name}" for name in re.findall(r"^\s+([\w:]+) \(noflash\)$", fragment, re.MULTILINE)}


def in_flash(
    program: Program, in_ram: Iterable[str], root: str = MOTION, without: Iterable[str] = RARE_IN_MOTION
) -> list[str]:
    """What of a function's calls has to be fetched from flash: each line of the cache that is missing delays it.
    @param in_ram  placed_in_ram() of every linker.lf"""
    placed = set(in_ram)
    found = [f"there is no {root}()"] if root not in program.functions else []
    for name in sorted(reachable(program, [root], without)):
        function = program.functions[name]
        if not _is_in_ram(function, placed):
            found.append(f"{function.file}: {name}() lies in flash ({function.section})")
    return found


def violations(program: Program, in_ram: Iterable[str], roots: Iterable[str] = ROOTS) -> list[str]:
    """What breaks the rules of interrupt handlers. @param in_ram  placed_in_ram() of every linker.lf"""
    placed = set(in_ram)
    problems = [f"there is no handler {root}()" for root in roots if root not in program.functions]
    of_step, of_others = reachable(program, {STEP} & set(roots)), reachable(program, set(roots) - {STEP})
    for name in sorted(of_step | of_others):
        allowed = () if name in of_step else ALLOWED_CALLS
        faults = _faults(program, name, placed, allowed)
        if name in of_step:
            faults += _faults_above_windows(program, name)
        problems += [f"{program.functions[name].file}: {name}() {what}" for what in faults]
    return problems


def panic_violations(program: Program, in_ram: Iterable[str], roots: Iterable[str] = PANIC) -> list[str]:
    """What the way of a panic needs from flash, whose cache may be off or broken then.
    @param in_ram  placed_in_ram() of every linker.lf"""
    placed = set(in_ram)
    problems = [f"there is no {root}()" for root in roots if root not in program.functions]
    for name in sorted(reachable(program, roots)):
        faults = _faults(program, name, placed, PANIC_CALLS)
        problems += [f"{program.functions[name].file}: {name}() {what}" for what in faults]
    return problems


def _faults_above_windows(program: Program, name: str) -> list[str]:
    """What breaks the rules of code that the vector calls."""
    faults = [
        f"uses {word}, which the vector does not save"
        for word in sorted(program.functions[name].mnemonics)
        if UNSAVED.match(word)
    ]
    own_files = {other.file for other in program.every if other.name == name} - {program.functions[name].file}
    callers = {
        other.name
        for other in program.every
        if name in other.calls and other.file not in own_files and "entry" in other.mnemonics
    }
    return faults + [f"is called by {caller}(), which has another ABI" for caller in sorted(callers)]


def _faults(program: Program, name: str, placed: set[str], allowed: Iterable[str]) -> list[str]:
    function = program.functions[name]
    faults = []
    if not _is_in_ram(function, placed):
        faults.append(f"lies in flash ({function.section})")
    for callee in sorted(function.calls):
        if callee not in program.functions and callee not in allowed:
            faults.append(f"calls {callee}, which is not allowed")
    for symbol in sorted(function.symbols):
        if program.data.get(symbol, "").startswith(".rodata") and _object(function) not in placed:
            faults.append(f"reads {symbol} in flash")
    faults += [f"uses floating point ({word})" for word in sorted(function.mnemonics) if FLOAT.match(word)]
    faults += [f"divides ({word})" for word in sorted(function.mnemonics) if word in DIVISION]
    return faults


def _object(function: Function) -> str:
    """As a linker.lf's entry, see placed_in_ram()."""
    return f"{function.file.split('/')[0]}:{Path(function.file).stem}"


def _is_in_ram(function: Function, placed: set[str]) -> bool:
    names = {_object(function), f"{_object(function)}:{function.name}"}
    return function.section.startswith(".iram1") or bool(names & placed)


def interrupt_program(root: Path, output: Path, sources: Iterable[Path]) -> Program:
    """All functions of the firmware, from the assembly text that compile_all() has left in output."""
    program = Program()
    for source in sources:
        name = source.relative_to(root)
        read_assembly((output / name.with_suffix(".s")).read_text(), str(name), program)
    return program


def firmware_in_ram(root: Path) -> set[str]:
    """What the core's linker fragment places in RAM; the target's own functions are marked one by one."""
    return placed_in_ram((root / "targets/esp32/components/core/linker.lf").read_text(), "core")


def longest_path(program: Program, name: str, without: Iterable[str] = ()) -> int:
    """Instructions of the longest way through a function with all that it calls, each loop passed once: the loops of
    the step interrupt only wait. @param without  ways on which one of these functions is called are left out"""
    if name in ALLOWED_CALLS:
        return ALLOWED_CALLS[name]
    function = program.functions[name]
    excluded = set(without)
    memo: dict[tuple[str, frozenset[tuple[str, str]]], int | None] = {}

    def way(label: str, registers: dict[str, str], passed: frozenset[str]) -> int | None:
        if label in passed:
            return None
        key = label, frozenset(registers.items())
        if key not in memo:
            memo[key] = measured(label, registers, passed | {label})
        return memo[key]

    def measured(label: str, registers: dict[str, str], passed: frozenset[str]) -> int | None:
        block = function.blocks[label]
        called, held = block.calls(registers)
        if excluded & set(called):
            return None
        own = block.count + sum(longest_path(program, callee, excluded) for callee in called)
        ways = [way(following, held, passed) for following in block.next if following in function.blocks]
        onward = [length for length in ways if length is not None]
        return own + max(onward, default=0) if onward or not block.next else None

    return way(name, {}, frozenset()) or 0


def vector_instructions(root: Path) -> int:
    """Of entry and exit: ESP-IDF's vector, and ours around the call of step_interrupt()."""
    text = (root / VECTOR).read_text().partition("xt_highint5:\n")[2]
    return BEFORE_VECTOR + len(re.findall(r"^    [a-z]", text, re.MULTILINE))


def step_interrupt(program: Program, root: Path) -> dict[str, int]:
    """Instructions of the step interrupt's longest paths, by what happens: all from the vector to the return."""
    vector = vector_instructions(root)
    return {
        "event": vector + longest_path(program, STEP, SELDOM),
        "event that ends a span": vector + longest_path(program, STEP, ["put_probing_event", "step_alarm_wraps"]),
        "event that ends a span as the probe closes": vector + longest_path(program, STEP),
    }
