"""G33, G33.1 and G76 as LinuxCNC's interpreter lays them out, against ours: where each pass runs, and how deep.

Compared is what cuts. Between passes LinuxCNC goes beyond the drive line, and at the entry of a taper it waits there.
"""

from __future__ import annotations

import ctypes
import re
import subprocess
from pathlib import Path

import pytest
from gcode_core import Controller
from layouts import HOST
from patience import HANG_S

START = {"X": 20.0, "Z": 5.0}
CALL = re.compile(r"^\s*\d+ N\S*\s+(\w+)\(([^)]*)\)")
RAPID, PASS = 0, 1


def rs274_passes(line: str, folder: Path) -> list[tuple[float, float, float]]:
    """X that each pass is deep, Z where it begins and ends: feeds that are tied to the spindle."""
    program = folder / "thread.ngc"
    program.write_text(f"G21 G18 G8 G0 X{START['X']} Z{START['Z']}\nM3 S100\n{line}\nM2\n")
    run = subprocess.run(["rs274", "-g", str(program)], capture_output=True, text=True, timeout=HANG_S, cwd=folder)
    assert run.returncode == 0, run.stderr
    passes, at, tied = [], (START["X"], START["Z"]), False
    for text in run.stdout.splitlines():
        found = CALL.match(text)
        if not found:
            continue
        words = [float(word) for word in found[2].split(",")] if found[1].startswith("STRAIGHT") else []
        if found[1] == "START_SPEED_FEED_SYNC" and not tied:
            tied, feeds = True, [at]
        elif found[1] == "STOP_SPEED_FEED_SYNCH":
            tied = False
            deep = max(feeds, key=lambda place: abs(place[0] - START["X"]))[0]
            passes.append((deep, feeds[0][1], feeds[-1][1]))
        elif words:
            at = (words[0], words[2])
            if tied:
                feeds.append(at)
    return passes


def our_passes(lib: ctypes.CDLL, line: str) -> list[tuple[float, float, float]]:
    controller = Controller(lib)
    for before in ("G18", f"G0X{START['X']}Z{START['Z']}", "M3S100"):
        assert controller.answer(before) == 0
    status, command = controller.resolve(line.replace(" ", ""))
    assert status == 0
    thread, action = HOST.struct("thread")(), HOST.struct("thread_action")()
    lib.thread_begin(ctypes.byref(thread), controller.state.position_mm, ctypes.byref(command.move))
    passes, at = [], [START["X"], START["Z"]]
    while lib.thread_next(ctypes.byref(thread), ctypes.byref(action)):
        x, z = action.target_mm[0], action.target_mm[2]
        if action.kind == PASS:
            ends = (at[0], x, at[0] + action.depth_mm if command.move.thread.entry else x)
            passes.append((max(ends, key=lambda place: abs(place - START["X"])), at[1], z))
        at = [x, z]
    return passes


@pytest.mark.parametrize(
    "line",
    [
        "G76 P1.5 Z-20 I-2 J.2 K.8",
        "G76 P1.5 Z-20 I-2 J.2 K.9 R1.5 H2",
        "G76 P1.5 Z-20 I-2 J.2 K1 R2 Q29.5 H1",
        "G76 P1.5 Z-20 I2 J.3 K1 R2 Q30",
        "G76 P1.5 Z30 I-2 J.3 K1 R2 Q30",
        "G76 P1.5 Z-20 I-2 J.4 K.8 E1.6 L1",
        "G76 P1.5 Z-20 I-2 J.4 K.8 E1.6 L2 Q30",
        "G76 P1.5 Z-20 I2 J.4 K.8 E1.6 L3 H1",
    ],
)
def test_passes(line: str, lib: ctypes.CDLL, tmp_path: Path) -> None:
    theirs, ours = rs274_passes(line, tmp_path), our_passes(lib, line)
    assert len(ours) == len(theirs)
    for mine, other in zip(ours, theirs, strict=True):
        assert mine == pytest.approx(other, abs=1e-4)
