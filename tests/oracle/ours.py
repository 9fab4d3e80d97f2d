"""What our parser makes of the same program, in the same words."""

from __future__ import annotations

import ctypes
import math

from canon import PLANES, Call, Refused
from gcode_core import (
    ACTION_DWELL,
    ACTION_FEED,
    ACTION_RAPID,
    ARC_CCW,
    ARC_CW,
    CYCLE,
    LINE_NONE,
    LINE_READY,
    LINEAR,
    NO_MOTION,
    PROBE,
    RAPID,
    Action,
    Axes,
    Command,
    Controller,
    Cycle,
    LineReader,
    begin_arc,
)

WHAT = {RAPID: "rapid", LINEAR: "feed", ARC_CW: "arc", ARC_CCW: "arc", PROBE: "probe"}
CHORD_MM = 0.001


def filtered(lib: ctypes.CDLL, program: str) -> list[str]:
    """The lines that the controller's own reader makes of a text."""
    reader, lines = LineReader(), []
    lib.line_reader_reset(ctypes.byref(reader))
    for byte in program.encode():
        result = lib.line_reader_put(ctypes.byref(reader), byte)
        if result == LINE_NONE:
            continue
        if result != LINE_READY:
            raise Refused(f"line {len(lines) + 1} is too long")
        lines.append(reader.text.decode())
    return lines


class Ours:
    """A controller, and what it has been given to do."""

    def __init__(self, lib: ctypes.CDLL, axes: int) -> None:
        self.cnc = Controller(lib, axes)
        self.calls: list[Call] = []

    def run(self, line: str) -> None:
        """One filtered line. Raises Refused."""
        status, command = self.cnc.resolve(line)
        if status != 0:
            raise Refused(f"{line}: error:{status}")
        if command.dwell_s >= 0:
            self.calls.append(Call("dwell", seconds=command.dwell_s))
        if command.move.motion != NO_MOTION:
            self._move(command)
        self.cnc.answer(line)

    def work_offset_mm(self) -> list[float]:
        """What a programmed 0 is in machine coordinates."""
        offset = (ctypes.c_double * 6)()
        self.cnc.lib.gcode_work_offset_mm(ctypes.byref(self.cnc.state), offset)
        return list(offset)

    def _move(self, command: Command) -> None:
        move = command.move
        if move.motion == CYCLE:
            self._cycle(command)
            return
        if move.via:
            self.calls.append(Call("rapid", tuple(move.via_mm)))
        feed = 60.0 * self._feed_mm_s(command)
        plane, center, turns = (0, 1, 2), (0.0, 0.0), 0
        if move.motion in (ARC_CW, ARC_CCW):
            plane = list(PLANES.values())[move.plane]
            center = (move.center_mm[0], move.center_mm[1])
            turns = (move.turns + 1) * (1 if move.motion == ARC_CCW else -1)
        self.calls.append(Call(WHAT[move.motion], tuple(move.target_mm), feed, center, plane, turns))

    def _cycle(self, command: Command) -> None:
        cycle, action = Cycle(), Action()
        start = Axes(*self.cnc.state.position_mm)
        self.cnc.lib.cycle_begin(ctypes.byref(cycle), start, ctypes.byref(command.move))
        while self.cnc.lib.cycle_next(ctypes.byref(cycle), ctypes.byref(action)):
            if action.kind == ACTION_DWELL:
                self.calls.append(Call("dwell", seconds=action.dwell_s))
            elif action.kind == ACTION_RAPID:
                self.calls.append(Call("rapid", tuple(action.target_mm)))
            elif action.kind == ACTION_FEED:
                self.calls.append(Call("feed", tuple(action.target_mm), command.move.feed_mm_s * 60.0))

    def _feed_mm_s(self, command: Command) -> float:
        """Inverse time gives the move's duration; along an arc its length tells the rest."""
        move, start = command.move, self.cnc.state.position_mm
        if move.motion == LINEAR and list(start) == list(move.target_mm):
            return float(command.next.feed_mm_s)  # no way, no speed: as programmed
        if move.inverse_time_s == 0.0:
            return 0.0 if move.motion == RAPID else float(move.feed_mm_s)
        if move.motion == LINEAR:
            length = math.dist(tuple(start)[:3], tuple(move.target_mm)[:3])
        else:
            arc = begin_arc(self.cnc.lib, list(start), move, CHORD_MM)
            length = self.cnc.lib.arc_length_mm(ctypes.byref(arc))
        return float(length / move.inverse_time_s)
