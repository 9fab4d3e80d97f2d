"""Whether a machine fits a board: its axes, its step pulse, and the second motors of a gantry."""

from __future__ import annotations

from wificnc.board.model import AXES_MAX, Board
from wificnc.board.shift_registers import GRIDS_MAX, step_grid_ns
from wificnc.errors import UserError
from wificnc.profile.model import Machine, Second
from wificnc.tables import AXES

NS_PER_US = 1_000


def check_fit(board: Board, machine: Machine) -> None:
    """The board has the axes and makes the pulse, and every second motor has a driver. Raises UserError."""
    if machine.axis_count > len(board.axes):
        raise UserError(
            f"machine {machine.name} needs {machine.axis_count} axes, board {board.id} has {len(board.axes)}",
            hint="`wificnc boards list` shows the axes of every board",
        )
    pulse_us, most_us = machine.stepper.step_pulse_us, GRIDS_MAX * step_grid_ns(board) // NS_PER_US
    if pulse_us and most_us and pulse_us > most_us:
        raise UserError(
            f"the shift registers of board {board.id} make step pulses of {most_us} us at most, not {pulse_us}",
            hint="a shorter [stepper] step_pulse_us; drivers need 1 to 5 us",
        )
    for index, second in machine.second_motors():
        misfit = _misfit(board, index, second)
        if misfit:
            reason, hint = misfit
            raise UserError(f"[axis.{AXES[index].lower()}.second] of {machine.name}: {reason}", hint=hint)


def _misfit(board: Board, index: int, second: Second) -> tuple[str, str] | None:
    fixed = board.ganged_axes >> index & 1
    spare = [letter for n, letter in enumerate(board.axes) if n > index and not board.ganged_axes >> n & 1]
    if second.driver is None:
        if not fixed:
            words = " or ".join(f'driver = "{letter.lower()}"' for letter in spare)
            hint = f"name a driver to spare: {words}" if spare else "use a board with a gantry"
            return f"board {board.id} has no second motor of {AXES[index]}", hint
        switch, at = AXES_MAX + index, f"the second motor of {AXES[index]}"
    else:
        letter = second.driver.upper()
        if fixed:
            return f"board {board.id} has a second motor of {AXES[index]} already", "leave out driver"
        if letter not in spare:
            hint = f"to spare are: {', '.join(spare)}" if spare else "use a board with a gantry"
            return f"board {board.id} has no driver of {letter} to spare", hint
        switch, at = AXES.index(letter), f"axis {letter}"
    if second.own_switch and board.switchless >> switch & 1:
        return f"{at} has no limit or home switch on board {board.id}", "own_switch = false"
    return None
