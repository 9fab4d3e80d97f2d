"""Words that Grbl does not have: tool table, tool change, more coordinate systems, switches, outputs."""

from __future__ import annotations

import ctypes

import pytest
from gcode_core import (
    FLOOD,
    SPINDLE_CCW,
    SPINDLE_CW,
    SPINDLE_OFF,
    STORE_G92,
    STORE_G92_ALONE,
    STORE_TOOL,
    Controller,
)

FEED, SPINDLE, HOLD = 1, 2, 4
DIGITAL_OUT, ANALOG_OUT, DIGITAL_IN, ANALOG_IN = range(4)


# -- tool table


def test_g43_takes_the_length_from_the_table(cnc: Controller) -> None:
    command = cnc.run("G10L1P7Z12.5")
    assert (command.store, command.store_tool, command.store_tool_mm) == (STORE_TOOL, 6, 12.5)
    assert cnc.state.offsets.tool_length_mm == 0, "the table alone changes nothing"
    command = cnc.run("G43H7")
    assert (command.store_tool_length, command.tool_length_mm, command.move.motion) == (True, 12.5, 5)
    cnc.run("G0Z1")
    assert cnc.position()[2] == 13.5
    cnc.run("G43H0", "Z1")
    assert cnc.position()[2] == 1


def test_g43_counts_in_its_own_line(cnc: Controller) -> None:
    """`G43 Z5 H1`, as CAM programs write it: the axis words belong to the motion."""
    cnc.run("G10L1P1Z20", "G0G43Z5H1")
    assert cnc.position() == [0, 0, 25]
    cnc.run("G49", "G0Z5")
    assert cnc.position() == [0, 0, 5]


def test_g43_without_h_means_the_tool_in_the_spindle(cnc: Controller) -> None:
    cnc.run("G10L1P1Z10", "G10L1P2Z20")
    assert cnc.answer("T1G43") == 28, "none is in the spindle"
    assert cnc.run("T1M6").tool_change
    cnc.run("T2")
    assert cnc.run("G43").tool_length_mm == 10, "T2 only waits"
    assert cnc.run("M6G43").tool_length_mm == 20


def test_g10_l10_makes_the_position_read(cnc: Controller) -> None:
    cnc.run("G10L2P1Z-30", "G0Z5", "G92Z10", "G43.1Z3", "G10L10P4Z1.5", "G43H4")
    before = cnc.position()
    cnc.run("G0Z1.5")
    assert cnc.position() == before


def test_g10_l11_means_g59_3_without_g92(cnc: Controller) -> None:
    """`the current coordinates become the given value in G59.3 without any G92 offset`."""
    cnc.run("G10L2P9Z-40", "G10L2P1Z7", "G0Z-3", "G92Z100", "G10L11P5Z2")
    before = cnc.position()
    assert cnc.state.offsets.tool_mm[4] == before[2] + 40 - 2
    cnc.run("G92.1", "G59.3", "G43H5", "G0Z2")
    assert cnc.position() == before


def test_inches_in_the_table(cnc: Controller) -> None:
    cnc.run("G20G10L1P1Z1")
    assert cnc.state.offsets.tool_mm[0] == pytest.approx(25.4, abs=2e-6)


# -- coordinate systems


@pytest.mark.parametrize(("code", "row"), [("G59", 5), ("G59.1", 6), ("G59.2", 7), ("G59.3", 8)])
def test_more_coordinate_systems(cnc: Controller, code: str, row: int) -> None:
    cnc.run(f"G10L2P{row + 1}X{row}", code, "G0X1")
    assert (cnc.state.modal.wcs, cnc.position()[0]) == (row, row + 1)
    cnc.run("G10L20P0X0")
    assert cnc.state.offsets.wcs_mm[row][0] == row + 1


def test_g92_2_and_g92_3(cnc: Controller) -> None:
    """G92.2 suspends the offset, G92.3 brings it back, G92.1 forgets it."""
    assert cnc.run("G0X10", "G92X3").store == STORE_G92
    assert cnc.run("G92.2").store == STORE_G92_ALONE
    assert cnc.state.offsets.g92_mm[0] == 0
    cnc.run("G92.3")
    assert cnc.state.offsets.g92_mm[0] == 7
    cnc.run("G92.1", "G92.3")
    assert cnc.state.offsets.g92_mm[0] == 0


# -- tool change


def test_m6_switches_off_and_the_line_switches_on_anew(cnc: Controller) -> None:
    cnc.run("M3S100M8")
    command = cnc.run("T2M6")
    assert (command.tool_change, command.sync) == (True, False)
    modal = cnc.state.modal
    assert (modal.tool_in_spindle, modal.spindle, modal.coolant) == (2, SPINDLE_OFF, 0)
    cnc.run("M3")
    command = cnc.run("M6M3M8T9")
    assert (command.tool_change, command.sync, command.spindle, command.coolant) == (True, True, SPINDLE_CW, FLOOD)
    assert cnc.run("M6M4").spindle == SPINDLE_CCW


# -- override switches


@pytest.mark.parametrize(
    ("lines", "bits"),
    [
        (["M49"], HOLD),
        (["M49", "M48"], FEED | SPINDLE | HOLD),
        (["M50P0"], SPINDLE | HOLD),
        (["M51P0"], FEED | HOLD),
        (["M53P0"], FEED | SPINDLE),
        (["M49", "M50"], FEED | HOLD),
        (["M49", "M51P1"], SPINDLE | HOLD),
        (["M53P0", "M53"], FEED | SPINDLE | HOLD),
        (["M49", "M53P0", "M2"], FEED | SPINDLE | HOLD),
    ],
)
def test_override_switches(cnc: Controller, lines: list[str], bits: int) -> None:
    assert cnc.state.modal.overrides == FEED | SPINDLE | HOLD
    cnc.run(*lines)
    assert cnc.state.modal.overrides == bits


def test_switches_wait_for_motion(cnc: Controller) -> None:
    assert [cnc.run(line).sync for line in ("M48", "M49", "M49", "M50P1")] == [False, True, False, True]


# -- outputs


@pytest.mark.parametrize(
    ("line", "port", "on", "waits"),
    [("M62P0", 0, True, True), ("M63P4", 4, False, True), ("M64P2", 2, True, False), ("M65P1", 1, False, False)],
)
def test_outputs(cnc: Controller, line: str, port: int, on: bool, waits: bool) -> None:
    command = cnc.run(line)
    assert (command.port, command.port_on, command.port_sync, command.sync) == (port, on, waits, waits)
    assert command.port_kind == DIGITAL_OUT and cnc.run("G0X1").port == -1


@pytest.mark.parametrize(
    ("line", "port", "percent", "waits"), [("M67E3Q12.5", 3, 12.5, True), ("M68E0Q100", 0, 100, False)]
)
def test_analog_outputs(cnc: Controller, line: str, port: int, percent: float, waits: bool) -> None:
    """`M67 - Synchronized with Motion`, `M68 - Immediate`: E is the number, Q the value."""
    command = cnc.run(line)
    assert (command.port_kind, command.port, command.port_pct) == (ANALOG_OUT, port, percent)
    assert command.port_sync is command.sync is waits


@pytest.mark.parametrize(
    ("line", "kind", "port", "wait", "seconds"),
    [
        ("M66P0", DIGITAL_IN, 0, 0, 0),
        ("M66P3L0Q7", DIGITAL_IN, 3, 0, 7),
        ("M66P1L1Q2.5", DIGITAL_IN, 1, 1, 2.5),
        ("M66P2L4Q1", DIGITAL_IN, 2, 4, 1),
        ("M66E3", ANALOG_IN, 3, 0, 0),
        ("M66E0L0", ANALOG_IN, 0, 0, 0),
    ],
)
def test_inputs(cnc: Controller, line: str, kind: int, port: int, wait: int, seconds: float) -> None:
    """`M66 P- | E- <L->`, L the mode: 0 immediate, 1 rise, 2 fall, 3 high, 4 low; Q the timeout."""
    command = cnc.run(line)
    assert (command.port_kind, command.port) == (kind, port)
    assert (command.wait, command.wait_s) == (wait, seconds)


def test_a_machine_without_inputs_and_analog_outputs_says_so(lib: ctypes.CDLL) -> None:
    cnc = Controller(lib)
    cnc.state.ports = (0, 0, 0, 0, False)
    assert [cnc.answer(line) for line in ("M66P0", "M66E0", "M67E0Q1", "M68E0Q1", "M64P0")] == [131] * 5
    cnc.state.ports = (5, 2, 1, 3, False)
    lines = ("M66P1", "M66P2", "M66E0", "M66E1", "M67E2Q1", "M67E3Q1")
    assert [cnc.answer(line) for line in lines] == [0, 131, 0, 131, 0, 131]


# -- diameters


def test_g7_halves_x_words_and_nothing_else(cnc: Controller) -> None:
    """`all moves in the X axis will be half the programmed distance`; I, J, K and R stay what they are."""
    cnc.run("G7", "G0X10Y10Z10")
    assert cnc.position() == [5, 10, 10]
    cnc.run("G91X10", "G90G20X2")
    assert cnc.position()[0] == pytest.approx(25.4)
    cnc.run("G21G53X8")
    assert cnc.position()[0] == 4
    cnc.run("G10L20P1X20", "X0")
    assert cnc.position()[0] == -6, "the position reads as a diameter of 20"
    move = cnc.run("F100G18G2X8Z10I2K0").move
    assert (move.target_mm[0], move.center_mm[1]) == (-6 + 4, -6 + 2)
    cnc.run("G8G0X1")
    assert cnc.position()[0] == -5


# -- modes kept


def modes(cnc: Controller) -> list[object]:
    return [getattr(cnc.state.modal, name) for name, *_ in cnc.state.modal._fields_]


def test_m70_and_m72_keep_the_modes(cnc: Controller) -> None:
    cnc.run("T3M6", "G10L1P3Z7", "G43", "F600S1000", "G91G18G55G99M3M8G1X1G61G20", "M49")
    before = modes(cnc)
    cnc.run("M70", "G90G17G54G98M5M9G64P1G21G93F1", "M48", "G8G49")
    assert modes(cnc) != before
    command = cnc.run("M72")
    assert modes(cnc) == before
    assert command.sync and command.spindle == SPINDLE_CW
    assert cnc.state.offsets.tool_length_mm == 7


def test_m72_leaves_motion_and_tool_alone_and_can_be_repeated(cnc: Controller) -> None:
    cnc.run("M70", "G38.3F9Z-1", "T5", "G91")
    cnc.run("M72")
    modal = cnc.state.modal
    assert (modal.motion, modal.probe, modal.tool, modal.incremental) == (4, 3, 5, False)
    cnc.run("G91", "M72G20", "M72")
    assert (cnc.state.modal.incremental, cnc.state.modal.inches) == (False, False)


def test_without_m70_there_is_nothing_to_restore(cnc: Controller) -> None:
    assert cnc.answer("M72") == 130
    assert cnc.answer("M70", "M71", "M72") == 130


def test_other_codes_of_the_line_come_after(cnc: Controller) -> None:
    cnc.run("M70G91", "M72")
    assert not cnc.state.modal.incremental, "M70 keeps what was before its line"
    cnc.run("M72G91")
    assert cnc.state.modal.incremental


# -- errors


@pytest.mark.parametrize(
    ("line", "answer"),
    [
        ("G43H97", 38),
        ("G43H1.5", 23),
        ("G43H-1", 4),
        ("H1", 20),
        ("G43H1G49", 21),
        ("G43H1G43.1Z1", 21),
        ("G10L1Z1", 28),  # no P
        ("G10L1P0Z1", 38),
        ("G10L1P97Z1", 38),
        ("G10L1P1.5Z1", 23),
        ("G10L1P1", 26),
        ("G10L1P1X1", 37),
        ("G10L1P1X1Z1", 37),
        ("G10L1P1Z1R-1", 4),
        ("G10L10P1Z1R1", 20),  # a radius is not touched off
        ("G10L1P1R200000", 33),
        ("G10L10P1Z200000", 33),
        ("G10L2P10X1", 29),
        ("G10L3P1Z1", 20),
        ("G59.4", 20),
        ("G92.4", 20),
        ("M6M6", 21),
        ("M62", 28),
        ("M64P5", 131),
        ("M64P1.5", 23),
        ("M62P0P1", 25),
        ("M62P0M63", 21),
        ("M48M49", 21),
        ("M48P1", 36),
        ("M52", 20),
        ("M66", 28),
        ("M66P4", 131),
        ("M66E4", 131),
        ("M66P0.5", 23),
        ("M66P0E0", 36),  # `It is an error to program both`
        ("M66P0L1", 132),  # `A Q value of zero is an error if the L-word is non-zero`
        ("M66P0L3Q0", 132),
        ("M66P0L5Q1", 132),
        ("M66P0L-1", 132),
        ("M66P0L1.5Q1", 23),
        ("M66E0L3Q1", 132),  # `Mode 0 is the only one permitted for an analog input`
        ("M66E-1", 4),
        ("M66P0L1Q-1", 4),
        ("M66P0M62P1", 21),
        ("M67Q1", 28),
        ("M67E0", 28),
        ("M67E4Q1", 131),
        ("M67E0.5Q1", 23),
        ("M68E0Q100.1", 133),
        ("M68E0Q-1", 4),
        ("M68P0Q1", 28),
        ("G1X1E2", 20),
        ("M70M72", 21),
        ("M70M73", 21),
        ("G7G8", 21),
        ("M50P1G4", 28),
    ],
)
def test_errors_change_nothing(cnc: Controller, line: str, answer: int) -> None:
    before = bytes(cnc.state)
    assert cnc.answer(line) == answer
    assert bytes(cnc.state) == before
