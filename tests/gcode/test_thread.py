"""G33, G33.1, G76, G95: what a line means, and which lines are errors. What is quoted is LinuxCNC's documentation."""

from __future__ import annotations

import math

import pytest
from gcode_core import Controller

LINE, TAP, CYCLE = range(3)
NEGATIVE, BAD_NUMBER, NO_FEED, NO_AXIS_WORDS, VALUE_MISSING, AXIS_WORDS_UNUSED, BAD_TARGET = 4, 2, 22, 26, 28, 31, 33
NO_ENCODER, SPINDLE_OFF, THREAD_PLANE = 150, 151, 152
G76 = "G76P1.5Z-20I-2J.2K1"


@pytest.fixture
def cnc(lib) -> Controller:  # type: ignore[no-untyped-def]
    controller = Controller(lib, axes=0b111111)
    assert controller.answer("M3S600") == 0
    return controller


def thread_of(cnc: Controller, line: str):  # type: ignore[no-untyped-def]
    status, command = cnc.resolve(line)
    assert status == 0, line
    return command.move


@pytest.mark.parametrize(
    ("line", "status"),
    [
        ("G33", NO_AXIS_WORDS),  # `It is an error if: All axis words are omitted`
        ("G33K1", NO_AXIS_WORDS),
        ("G33Z-1", VALUE_MISSING),
        ("G33Z-1K0", BAD_NUMBER),
        ("G33Z-1K-1", NEGATIVE),
        ("G33Z0K1", BAD_TARGET),
        ("G33A5K1", AXIS_WORDS_UNUSED),
        ("G33Z-1K1I2", 36),
        ("G33.1", NO_AXIS_WORDS),
        ("G33.1Z-1K1I0", BAD_NUMBER),
        ("G33.1Z-1K1I-2", BAD_NUMBER),
        ("G33.2Z-1K1", 20),
        ("M5G33Z-1K1", SPINDLE_OFF),  # `The spindle is not turning when this command is executed`
        ("S0G33Z-1K1", SPINDLE_OFF),
        ("M5G18" + G76, SPINDLE_OFF),
        (G76, THREAD_PLANE),  # `The active plane is not the ZX plane`
        ("G18" + G76 + "X1", AXIS_WORDS_UNUSED),  # `Other axis words, such as X- or Y-, are specified`
        ("G18" + G76 + "R.5", BAD_NUMBER),  # `The R- degression value is less than 1.0`
        ("G18G76Z-20I-2J.2K1", VALUE_MISSING),  # `All the required words are not specified`
        ("G18G76P1.5I-2J.2K1", NO_AXIS_WORDS),
        ("G18G76P1.5Z-20J.2K1", VALUE_MISSING),
        ("G18G76P1.5Z-20I-2K1", VALUE_MISSING),
        ("G18G76P1.5Z-20I-2J.2", VALUE_MISSING),
        ("G18G76P-1Z-20I-2J.2K1", NEGATIVE),  # `P-, J-, K- or H- is negative`
        ("G18G76P1Z-20I-2J-.2K1", NEGATIVE),
        ("G18G76P1Z-20I-2J.2K-1", NEGATIVE),
        ("G18" + G76 + "H-1", NEGATIVE),
        ("G18" + G76 + "H1.5", 23),
        ("G18" + G76 + "E10.1L1", BAD_NUMBER),  # `E- is greater than half the drive line length`
        ("G18" + G76 + "L1", BAD_NUMBER),
        ("G18" + G76 + "E1L4", BAD_NUMBER),
        ("G18" + G76 + "E-1L1", NEGATIVE),
        ("G18" + G76 + "Q81", BAD_NUMBER),
        ("G18G76P1Z-20I0J.2K1", BAD_NUMBER),
        ("G18G76P1Z-20I-2J1K1", BAD_NUMBER),  # `K must be greater than J`
        ("G18G76P1Z-1I-2J.2K1Q60", BAD_NUMBER),  # slides beyond its end
        ("G18G76P1Z0I-2J.2K1", BAD_TARGET),
        ("G18G76P1Z-20I-2J.001K2R1", BAD_NUMBER),  # 2000 passes
        ("G1X5E1", 20),  # E is a word of G76 and M66 .. M68 only
        ("G95X1G1", NO_FEED),
        ("G95G1X1F.1M5", SPINDLE_OFF),
        ("G95G0X1", 0),
    ],
)
def test_errors(cnc: Controller, line: str, status: int) -> None:
    assert cnc.resolve(line)[0] == status


def test_a_machine_without_an_encoder_says_so(cnc: Controller) -> None:
    cnc.state.ports.encoder = False
    lines = ("G33Z-1K1", "G33.1Z-1K1", "G18" + G76, "G95", "G95G1X1F1")
    assert [cnc.resolve(line)[0] for line in lines] == [NO_ENCODER] * 5


def test_line_and_tap(cnc: Controller) -> None:
    """`G33.1 moves end at the original coordinate`"""
    move = thread_of(cnc, "G20G33X.1Z-1K.05")
    assert move.thread.kind == LINE and move.thread.pitch_mm == pytest.approx(1.27)
    assert list(move.target_mm)[:3] == pytest.approx([2.54, 0, -25.4])
    tap = thread_of(cnc, "G33.1Z-8K1.25")
    assert tap.thread.kind == TAP and tap.thread.return_speed == 1 and tap.via_mm[2] == -8
    assert list(tap.target_mm) == list(cnc.state.position_mm)
    assert thread_of(cnc, "G33.1Z-8K1.25I1.5").thread.return_speed == 1.5


def test_cycle(cnc: Controller) -> None:
    thread = thread_of(cnc, "G18" + G76 + "R2Q30H3E1.5L3").thread
    assert thread.kind == CYCLE and thread.springs == 3 and thread.entry and thread.exit
    assert thread.slide == pytest.approx(math.tan(math.radians(30))) and thread.degression == 2
    assert (thread.pitch_mm, thread.peak_mm, thread.depth_mm, thread.taper_mm) == (1.5, -2, 1, 1.5)
    assert thread.first_mm == pytest.approx(0.2)


def test_cycle_ends_at_the_end_of_the_drive_line(cnc: Controller) -> None:
    """`The final position of the tool will be at the end of the drive line`"""
    assert cnc.answer("G0X10Z2") == 0
    move = thread_of(cnc, "G18" + G76)
    assert list(move.target_mm)[:3] == [10, 0, -20] and list(move.via_mm)[:3] == [7, 0, -20]


def test_diameters_and_inches(cnc: Controller) -> None:
    """`When G7 Lathe Diameter Mode is in force the values for I, J and K are diameter measurements`"""
    thread = thread_of(cnc, "G7G20G18G76P.05Z-1I-.2J.02K.1").thread
    assert thread.peak_mm == pytest.approx(-2.54) and thread.first_mm == pytest.approx(0.254)
    assert thread.depth_mm == pytest.approx(1.27) and thread.pitch_mm == pytest.approx(1.27)


def test_every_line_has_its_own_words(cnc: Controller) -> None:
    """K and the words of G76 are not modal; the motion mode is."""
    assert cnc.answer("G33Z-1K1") == 0
    assert cnc.answer("Z-2") == VALUE_MISSING and cnc.answer("Z-2K2") == 0


def test_feed_of_one_mode_is_none_in_the_other(cnc: Controller) -> None:
    assert cnc.answer("G95F.2") == 0
    status, command = cnc.resolve("G1X10")
    assert status == 0 and command.move.feed_mm_s == pytest.approx(2)
    assert cnc.answer("G94G1X10") == NO_FEED
    assert cnc.answer("M2") == 0 and cnc.answer("G1X10") == NO_FEED


def test_modes_that_are_brought_back_bring_their_feed(cnc: Controller) -> None:
    assert [cnc.answer(line) for line in ("G95F.2", "M70", "G94F600", "M72")] == [0] * 4
    status, command = cnc.resolve("G1X10")
    assert status == 0 and command.move.feed_mm_s == pytest.approx(2)


def test_speed_mode(cnc: Controller) -> None:
    assert cnc.answer("G97S100") == 0 and cnc.answer("G96S100") == 20 and cnc.answer("G96.1") == 20
