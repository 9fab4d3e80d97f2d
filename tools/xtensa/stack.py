"""How much stack the firmware's tasks need at most: frames of the machine code, added up along its calls.

A function's literals name whom it may call; a table of functions that it names counts as if it called all of them.
What is called through a pointer that someone else has set is not seen: ELSEWHERE has those that matter. Frames are
LLVM's, the real compiler's are near them. ESP-IDF's own functions are not in it.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from xtensa.isr import Function, Program

# task -> the function it runs, its file, its stack in task_map.h
TASKS = {
    "motion": ("run", "targets/esp32/app/motion_task.c", "MOTION_TASK_STACK"),
    "controller": ("firmware_run_controller", "targets/esp32/main/run.c", "CONTROLLER_TASK_STACK"),
    "network": ("run", "targets/esp32/net/network.c", "NETWORK_TASK_STACK"),
}

# Who calls through struct net_hub_ops what app/controller.c has put there.
ELSEWHERE = {
    "net_hub_read": ("act", "put", "login"),
    "net_hub_tick": ("act", "put", "login"),
    "net_hub_feed": ("put",),
    "net_hub_hear": ("hear",),
}

# The one recursion is an expression within an expression. It goes so deep.
RECURSIVE = "core/gcode/expression.c"
DEEPEST = re.compile(r"EXPRESSION_DEPTH_MAX = (\d+)")

# What is left for ESP-IDF's functions below ours (sockets, NVS), and for what an interrupt saves.
RESERVE = 1536


@dataclass(frozen=True)
class Way:
    """The deepest way down from a function."""

    bytes: int
    functions: tuple[str, ...]


class Stacks:
    """Depths of one program."""

    def __init__(self, program: Program, recursions: int) -> None:
        self.program = program
        self.recursions = recursions
        self.by_file = {(function.file, function.name): function for function in program.every}
        self.known: dict[tuple[str, str], Way] = {}

    def deepest(self, name: str, file: str) -> Way:
        """From this function on. Raises KeyError when there is none of that name."""
        return self._deepest(self.by_file[file, name], ())

    def _deepest(self, function: Function, above: tuple[Function, ...]) -> Way:
        key = function.file, function.name
        if key in self.known:
            return self.known[key]
        if any(each is function for each in above):
            first = next(n for n, each in enumerate(above) if each is function)
            return Way((self.recursions - 1) * sum(each.frame for each in above[first:]), ())
        ways = [self._deepest(callee, (*above, function)) for callee in self._callees(function)]
        down = max(ways, key=lambda way: way.bytes, default=Way(0, ()))
        found = Way(function.frame + down.bytes, (function.name, *down.functions))
        if function.file != RECURSIVE:  # there it depends on where the recursion was entered
            self.known[key] = found
        return found

    def _callees(self, function: Function) -> list[Function]:
        names = set(function.symbols) | set(ELSEWHERE.get(function.name, ()))
        for symbol in function.symbols:
            names |= self.program.tables.get(symbol, set())
        found = [self.by_file.get((function.file, name)) or self.program.functions.get(name) for name in names]
        return [callee for callee in found if callee is not None]


def task_stacks(program: Program, root: Path) -> dict[str, tuple[Way, int]]:
    """Task -> its deepest way, and the stack that it has."""
    depth = DEEPEST.search((root / RECURSIVE).with_suffix(".h").read_text())
    sizes = dict(re.findall(r"(\w+_STACK) = (\d+)", (root / "targets/esp32/app/task_map.h").read_text()))
    assert depth
    stacks = Stacks(program, int(depth[1]))
    return {task: (stacks.deepest(name, file), int(sizes[size])) for task, (name, file, size) in TASKS.items()}
