"""What a program can ask of a board's outputs and inputs, which boards have it, and the answer where they do not."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from wificnc.board.model import Board


@dataclass(frozen=True)
class Ability:
    """Codes or settings that need a pin. The core's half of it is core/machine/wiring.c."""

    name: str
    codes: str
    has: Callable[[Board], bool]
    without: str  # the answer of a board that lacks it


ABILITIES = (
    Ability(
        "spindle on and off",
        "M3",
        lambda board: bool(board.output.spindle_enable or board.output.spindle_pwm),
        "error:135",
    ),
    Ability("spindle drive on RS-485", "$395", lambda board: board.spindle_bus is not None, "error:190"),
    Ability(
        "spindle speed",
        "S, $30, $31",
        lambda board: board.output.spindle_pwm is not None,
        "taken: a relay has one speed",
    ),
    Ability("laser", "$32=1", lambda board: board.output.spindle_pwm is not None, "error:17"),
    Ability(
        "spindle direction",
        "M4 without $32, G33.1",
        lambda board: board.output.spindle_dir is not None,
        "error:135",
    ),
    Ability(
        "flood coolant",
        "M8, 0xA0",
        lambda board: board.output.coolant_flood is not None,
        "a message once in a program; error:135 with $91=0",
    ),
    Ability(
        "mist coolant",
        "M7, 0xA1",
        lambda board: board.output.coolant_mist is not None,
        "a message once in a program; error:135 with $91=0",
    ),
    Ability("digital outputs", "M62 to M65, $83", lambda board: board.digital_outputs > 0, "error:131; $83 error:135"),
    Ability("digital inputs", "M66 P", lambda board: board.digital_inputs > 0, "error:131"),
    Ability("analog inputs and outputs", "M66 E, M67, M68", lambda board: board.has_analog, "error:131"),
    Ability("RC servo", "$85", lambda board: board.output.servo is not None, "error:135"),
    Ability("tool setter", "G65 P5 Q1", lambda board: board.input.toolsetter is not None, "error:136"),
    Ability("spindle encoder", "G33, G76, G95, $88", lambda board: board.encoder is not None, "error:150"),
)


def lacks(board: Board) -> list[Ability]:
    """What this board cannot do."""
    return [ability for ability in ABILITIES if not ability.has(board)]


def lack_lines(board: Board) -> list[str]:
    """The same as text."""
    return [f"{ability.name} ({ability.codes}): {ability.without}" for ability in lacks(board)]


def ability_rows(boards: Sequence[Board]) -> list[list[str]]:
    """A row per ability: its name, its codes, yes or no for each board, and the answer without it."""
    return [
        [
            ability.name,
            ability.codes,
            *("yes" if ability.has(board) else "–" for board in boards),
            ability.without,
        ]
        for ability in ABILITIES
    ]
