"""What the machine code of the interrupt handlers says: what they call, whether they use floating point, divide, or
touch HI and LO where no one saves them, and how many instructions their longest path has.

Read from the disassembly of the image, calls and jumps resolved by address; not from measurements.
"""

from __future__ import annotations

import re
import subprocess
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

OBJDUMP = "mipsel-linux-gnu-objdump"

# Vectors of startup.S: those of the steps' level, where nothing saves HI and LO, and the others.
STEP_VECTORS = ("_vector_step", "_vector_pulse_end")
SAVING_VECTORS = (
    "_vector_edge",
    "_vector_switch_timer",
    "_vector_uart_rx",
    "_vector_uart_tx",
    "_vector_bus_rx",
    "_vector_bus_tx",
    "_vector_tick",
)

# What the step interrupt does only when a span ends, or the probe is watched.
PROBING = "put_probing_event"
SELDOM = ("next_span", PROBING)

FLOAT = re.compile(r"^(c\.\w+\.\w+|\w+\.(s|d|w|l|ps)(\.\w+)?|[ls][wd]x?c1|m[ft]h?c1|c[ft]c1|bc1\w+|mov[ft])$")
DIVISION = re.compile(r"^(div|divu|rem|remu)$")
HILO = re.compile(r"^(mult|multu|madd|maddu|msub|msubu|mul|mfhi|mflo|mthi|mtlo|div|divu)$")
BRANCH = re.compile(r"^b(?!reak)\w*$")
LINE = re.compile(r"^\s*([0-9a-f]+):\t([\w.]+)\s*(.*)$")
HEAD = re.compile(r"^([0-9a-f]+) <([^>]+)>:$")


@dataclass(frozen=True)
class Instruction:
    """One line of the disassembly."""

    address: int
    mnemonic: str
    operands: str

    @property
    def target(self) -> int | None:
        """Where a branch, jump or call with a fixed target goes."""
        match = re.search(r"(?:^|,)([0-9a-f]{8})(?: <|$)", self.operands)
        return int(match[1], 16) if match else None

    @property
    def is_branch(self) -> bool:
        return bool(BRANCH.match(self.mnemonic)) or self.mnemonic in ("j", "jr", "jal", "jalr")

    @property
    def is_call(self) -> bool:
        return self.mnemonic in ("jal", "jalr", "bal")

    @property
    def is_jump(self) -> bool:
        """What follows behind its slot is reached from elsewhere. The disassembler writes `b` as beq zero,zero."""
        return self.mnemonic in ("j", "b") or (self.mnemonic == "beq" and self.operands.startswith("zero,zero"))


@dataclass
class Function:
    """A symbol of .text and what follows it."""

    name: str
    code: list[Instruction] = field(default_factory=list)


@dataclass
class Program:
    """All functions by name, and by the address of their first instruction."""

    functions: dict[str, Function] = field(default_factory=dict)
    at: dict[int, str] = field(default_factory=dict)


def disassemble(elf: Path) -> str:
    command = [OBJDUMP, "-d", "--no-show-raw-insn", "-M", "no-aliases", str(elf)]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def read_disassembly(text: str) -> Program:
    program = Program()
    function = Function("")
    for line in text.splitlines():
        if match := HEAD.match(line):
            function = Function(match[2])
            program.functions[function.name] = function
            program.at[int(match[1], 16)] = function.name
        elif match := LINE.match(line):
            function.code.append(Instruction(int(match[1], 16), match[2], match[3].strip()))
    return program


def calls(program: Program, function: Function) -> set[str]:
    """Functions that it calls or jumps to; what cannot be told is named as a pointer."""
    found = set()
    for instruction in function.code:
        if instruction.mnemonic in ("jalr",) or (instruction.mnemonic == "jr" and "ra" not in instruction.operands):
            found.add(f"a pointer in {instruction.operands.split(',')[-1]}")
        elif instruction.target is not None and instruction.target in program.at:
            found.add(program.at[instruction.target])
    return found - {function.name}


def reachable(program: Program, roots: Iterable[str]) -> set[str]:
    """Every function that a vector can come to."""
    found: set[str] = set()
    waiting = [root for root in roots if root in program.functions]
    while waiting:
        name = waiting.pop()
        if name not in found and name in program.functions:
            found.add(name)
            waiting += calls(program, program.functions[name])
    return found


def violations(program: Program) -> list[str]:
    """What breaks the rules of interrupt handlers."""
    problems = []
    for roots, saves_hilo in ((STEP_VECTORS, False), (SAVING_VECTORS, True)):
        problems += [f"there is no vector {root}" for root in roots if root not in program.functions]
        for name in sorted(reachable(program, roots)):
            problems += [f"{name}() {what}" for what in _faults(program, name, saves_hilo)]
    return sorted(set(problems))


def _faults(program: Program, name: str, saves_hilo: bool) -> list[str]:
    function = program.functions[name]
    mnemonics = sorted({instruction.mnemonic for instruction in function.code})
    faults = [f"calls {callee}" for callee in sorted(calls(program, function)) if callee.startswith("a pointer")]
    faults += [f"uses floating point ({word})" for word in mnemonics if FLOAT.match(word)]
    faults += [f"divides ({word})" for word in mnemonics if DIVISION.match(word)]
    if not saves_hilo:
        faults += [f"touches HI and LO, which nobody saves ({word})" for word in mnemonics if HILO.match(word)]
    return faults


# ---- the longest path ----


def longest_path(program: Program, name: str, without: Iterable[str] = ()) -> int:
    """Instructions from the first to the last of a function with all that it calls, each loop passed once: those of
    the step interrupts only wait. @param without  ways that lead through one of these functions are left out"""
    length = _Paths(program, frozenset(without)).of(name)
    if length is None:
        raise ValueError(f"{name} has no way without {', '.join(without)}")
    return length


class _Paths:
    """Longest ways by function."""

    def __init__(self, program: Program, without: frozenset[str]) -> None:
        self._program = program
        self._without = without
        self._memo: dict[str, int | None] = {}

    def of(self, name: str) -> int | None:
        if name in self._without:
            return None
        if name not in self._memo:
            self._memo[name] = None  # a way that comes back to a function is a loop, too
            self._memo[name] = _Function(self, self._program, self._program.functions[name]).longest()
        return self._memo[name]


class _Function:
    """The pieces of one function. An edge to a piece that is still being looked into goes back: a loop, passed once.
    Without those edges no way comes to a piece twice, so each has one length, wherever a way comes from."""

    def __init__(self, paths: _Paths, program: Program, function: Function) -> None:
        self._paths = paths
        self._program = program
        self._code = function.code
        self._by_address = {instruction.address: instruction for instruction in function.code}
        self._leaders = {instruction.target for instruction in function.code if instruction.is_branch}
        self._open: set[int] = set()
        self._lengths: dict[int, int | None] = {}

    def longest(self) -> int | None:
        return self._from(self._code[0].address)

    def _from(self, address: int) -> int | None:
        """From here to the end; None: no way leads there."""
        if address in self._open or address not in self._by_address:
            return None
        if address not in self._lengths:
            self._open.add(address)
            straight = _straight(self._by_address, self._leaders, address)
            last = self._by_address[straight[-1]]
            ways = [length for length in self._ways(last) if length is not None]
            own = len(straight) + (1 if last.is_branch else 0)  # and the branch's slot
            self._lengths[address] = own + max(ways) if ways else None
            self._open.remove(address)
        return self._lengths[address]

    def _ways(self, last: Instruction) -> list[int | None]:
        """What follows the end of a straight piece, each way by itself."""
        if last.mnemonic in ("jr", "eret"):
            return [0]
        if not last.is_branch:
            return [self._from(last.address + 4)]
        if last.is_call:
            callee = self._paths.of(self._program.at[last.target]) if last.target in self._program.at else None
            rest = self._from(last.address + 8)
            return [None if callee is None or rest is None else callee + rest]
        taken = self._to(last.target)
        return [taken] if last.is_jump else [taken, self._from(last.address + 8)]

    def _to(self, target: int | None) -> int | None:
        """A branch or jump; into another function, that one returns for this one."""
        if target is not None and target not in self._by_address and target in self._program.at:
            return self._paths.of(self._program.at[target])
        return None if target is None else self._from(target)


def _straight(by_address: dict[int, Instruction], leaders: set[int | None], address: int) -> list[int]:
    """Addresses up to the next branch, or to where one comes from elsewhere."""
    found = [address]
    while not by_address[found[-1]].is_branch and by_address[found[-1]].mnemonic != "eret":
        following = found[-1] + 4
        if following in leaders or following not in by_address:
            break
        found.append(following)
    return found
