"""Shift registers behind the I2S peripheral of an ESP32 or the SPI of an ESP32-S3: the rules of boards with them."""

from __future__ import annotations

from collections.abc import Iterator

from wificnc.board.chip import Chip, SpiWords, is_shifted, load_chips
from wificnc.board.model import BoardFile, Role, Use
from wificnc.files.problem import Finding

# What no word of a few microseconds can make, or what a task has to move more often than it looks at the registers.
NEEDS_A_PIN = ("spindle_pwm", "servo", "led", "charge_pump")
GRID_NS = 2_000  # a word of 32 bits at 16 MHz: what 74HC595 take at 3.3 V

GRIDS_MAX = 16  # STEP_GRID_MAX of core/machine/board.h


def pulse_engine(board: BoardFile) -> str:
    """What makes the pulses: [step] engine, and "spi" for "i2s" where the chip's SPI does its work."""
    chip = load_chips().get((board.target, board.chip))
    return "spi" if board.step.engine == "i2s" and chip and chip.spi_words else board.step.engine


def step_grid_ns(board: BoardFile) -> int:
    """Pulses and pauses are whole ones of it; 0: any."""
    return GRID_NS if pulse_engine(board) == "i2s" else 0


def on_grid_ns(board: BoardFile, ns: int) -> int:
    """A time as the engine makes it: that long or longer."""
    grid = step_grid_ns(board)
    return -(-ns // grid) * grid if grid else ns


def words_text(board: BoardFile) -> str:
    """What a user needs to know of the words; empty: steps do not go through registers."""
    if not board.i2so or board.step.engine != "i2s":
        return ""
    registers = board.i2so.outputs // 8
    through = f"steps, directions and I2SO outputs through {registers} shift register{'s' * (registers > 1)}"
    if pulse_engine(board) == "spi":
        return f"{through} (SPI): on the pins 2 us after the interrupt"
    word_us = GRID_NS // 1000
    return (
        f"{through} (I2S): a word each {word_us} us, pulses of 1 to {GRIDS_MAX} words, on the pins {word_us} to "
        f"{2 * word_us} us later"
    )


def shift_registers(board: BoardFile, chip: Chip) -> Iterator[Finding]:
    """A BoardRule."""
    engine = board.step.engine == "i2s"
    if board.i2so and not engine:
        hint = '[step]\nengine = "i2s"'
        yield Finding("shift-register", ("i2so",), 'needs `engine = "i2s"` in [step]', hint)
    if not engine:
        return
    if not board.i2so:
        yield Finding("shift-register", ("step", "engine"), "needs the wiring of shift registers, [i2so]")
        return
    if chip.i2s is None and chip.spi_words is None:
        reason = f"the {chip.name} has no peripheral that sends words to shift registers"
        yield Finding("shift-register", ("step", "engine"), reason, "wire the drivers to pins of the chip")
        return
    for use in board.uses():
        yield from _use(use)
    yield from _words_of_spi(board, chip.spi_words) if chip.spi_words else _words_of_fifo(board)


def _words_of_spi(board: BoardFile, words: SpiWords) -> Iterator[Finding]:
    if board.ethernet and board.ethernet.spi_host == words.host:
        hint = "the other SPI host of the chip"
        yield Finding("shift-register", ("ethernet", "spi_host"), f"{words.host} sends to the shift registers", hint)
    if board.timing.step_pulse_ns < words.word_ns:
        reason = f"{board.timing.step_pulse_ns} ns is shorter than a word, which takes {words.word_ns} ns"
        yield Finding("shift-register", ("timing", "step_pulse_ns"), reason, f"at least {words.word_ns} ns")


def _words_of_fifo(board: BoardFile) -> Iterator[Finding]:
    for key in ("step_pulse_ns", "dir_setup_ns"):
        ns = getattr(board.timing, key)
        if on_grid_ns(board, ns) != ns:
            reason = f"{ns} ns is not a whole number of words, each of which takes {GRID_NS} ns"
            hint = f"next whole word: {on_grid_ns(board, ns)} ns"
            yield Finding("shift-register", ("timing", key), reason, hint)
        elif ns > GRIDS_MAX * GRID_NS:
            reason = (
                f"{ns} ns is too long: at most {GRIDS_MAX} words of {GRID_NS} ns go into the I2S peripheral at a time"
            )
            yield Finding("shift-register", ("timing", key), reason)


def _use(use: Use) -> Iterator[Finding]:
    if use.role in (Role.STEP, Role.DIR) and not is_shifted(use.pin):
        reason = f"{use.pin} is not an output of the shift registers, which show steps and directions together"
        yield Finding("shift-register", use.path, reason, "wire it to I2SO.n, or leave [step] engine out")
    is_bus = use.role in (Role.ETHERNET, Role.SERIAL, Role.I2SO, Role.SPINDLE_BUS, Role.PENDANT, Role.DRIVER_BUS)
    if is_shifted(use.pin) and (use.signal in NEEDS_A_PIN or (use.is_output and is_bus)):
        reason = f"{use.pin} changes with a word of the step engine only, and {use.signal} needs a pin of the chip"
        yield Finding("shift-register", use.path, reason)
