"""What a line means: targets, feeds, offsets, modes, and in which order."""

from __future__ import annotations

import math
from ctypes import CDLL, byref, c_float

import pytest
from gcode_core import (
    AXES,
    BLEND,
    END,
    EXACT,
    EXACT_STOP,
    FLOOD,
    LINEAR,
    MIST,
    NO_MOTION,
    OPTIONAL_PAUSE,
    PAUSE,
    PER_MIN,
    PROBE,
    RAPID,
    RUN,
    SPINDLE_CCW,
    SPINDLE_CW,
    SPINDLE_OFF,
    STORE_G28,
    STORE_G92,
    STORE_NOTHING,
    STORE_WCS,
    XY,
    XYZABC,
    YZ,
    ZX,
    Controller,
)
from gcode_core import Axes as CAxes
from hypothesis import given
from hypothesis import strategies as st

MILLIMETRES = st.integers(-9_999_000, 9_999_000).map(lambda um: um / 1000)


@pytest.fixture
def six(lib: CDLL) -> Controller:
    """Six axes."""
    return Controller(lib, XYZABC)


# -- targets


@given(st.dictionaries(st.sampled_from(AXES), MILLIMETRES, min_size=1), st.booleans(), st.booleans(), st.data())
def test_target(lib: CDLL, words: dict[str, float], inches: bool, incremental: bool, data: st.DataObject) -> None:
    """Absolute: word + WCS + G92 + tool length. Incremental: word + position. Inches are lengths only."""
    cnc = Controller(lib, XYZABC)
    offsets, wcs = cnc.state.offsets, data.draw(st.integers(0, 5))
    for ax in range(6):
        cnc.state.position_mm[ax] = data.draw(MILLIMETRES)
        offsets.wcs_mm[wcs][ax] = data.draw(MILLIMETRES)
        offsets.g92_mm[ax] = data.draw(MILLIMETRES)
    offsets.tool_length_mm = data.draw(MILLIMETRES)
    start = list(cnc.state.position_mm)

    line = f"G{20 if inches else 21}G{91 if incremental else 90}G{54 + wcs}G0"
    status, command = cnc.resolve(line + "".join(f"{axis}{value:.3f}" for axis, value in words.items()))

    expected = list(start)
    for axis, value in words.items():
        ax = AXES.index(axis)
        scaled = value * 25.4 if inches and axis in "XYZ" else value
        work = offsets.wcs_mm[wcs][ax] + offsets.g92_mm[ax] + (offsets.tool_length_mm if axis == "Z" else 0)
        expected[ax] = scaled + (start[ax] if incremental else work)
    if any(abs(value) > 1e5 for value in expected):
        assert status == 33
    else:
        assert (status, command.move.motion) == (0, RAPID)
        assert list(command.move.target_mm) == pytest.approx(expected, abs=1e-9)


def test_work_offset(lib: CDLL) -> None:
    cnc = Controller(lib)
    cnc.run("G10L2P2X1Y2Z3", "G55", "G92X10", "G43.1Z0.5")
    out = CAxes()
    lib.gcode_work_offset_mm(byref(cnc.state), out)
    assert list(out)[:3] == [-10, 2, 3.5]
    cnc.run("G0X0Y0Z0")
    assert cnc.position() == list(out)[:3]


def test_g53_ignores_offsets_and_incremental(cnc: Controller) -> None:
    cnc.run("G10L2P1X5", "G92X3", "G43.1Z2", "G91", "G0X1Z1")
    cnc.run("G53X7Z4")
    assert cnc.position() == [7, 0, 4]
    cnc.run("G20G53X1")
    assert cnc.position() == [25.4, 0, 4]


def test_the_wcs_of_the_line_counts(cnc: Controller) -> None:
    cnc.run("G10L2P2X5", "G55G0X1")
    assert cnc.position()[0] == 6
    cnc.run("G54X1")
    assert cnc.position()[0] == 1


def test_limits_of_coordinates(cnc: Controller) -> None:
    cnc.run("G0X100000", "G0X-100000")
    for line in ("G0X100000.01", "G0X-100000.01", "G0X1000000000", "G20X3937.1", "G91X-0.01", "G53X100001"):
        assert cnc.answer(line) == 33
    for line in ("G10L2P1X100001", "G92X-300000", "G43.1Z100001", "G10L20P1X100001"):
        assert cnc.answer(line) == 33
    assert cnc.position() == [-100000, 0, 0]


# -- feed


def test_feed_is_per_minute_outside_and_per_second_inside(cnc: Controller) -> None:
    assert cnc.run("G1X1F1500").move.feed_mm_s == 25
    assert cnc.run("X2").move.feed_mm_s == 25
    assert cnc.run("G20F1X1").move.feed_mm_s == c_float(25.4 / 60).value
    assert cnc.run("G21X0").move.feed_mm_s == c_float(25.4 / 60).value
    assert cnc.run("G0X5").move.feed_mm_s == 0
    assert cnc.run("F600").move.motion == NO_MOTION
    assert cnc.run("G1X1").move.feed_mm_s == 10


@pytest.mark.parametrize("arc", ["G2X0I1", "G3Y0J-1", "G18G3X0K2", "G2X0I1A90"])
def test_feed_of_a_full_circle_in_inches(six: Controller, arc: str) -> None:
    """It ends where it begins, and moves all the same."""
    assert six.run("G20G91F60", arc).move.feed_mm_s == pytest.approx(25.4)


def test_feed_of_rotary_axes_knows_no_inches(six: Controller) -> None:
    assert six.run("G1A90F360").move.feed_mm_s == 6
    assert six.run("G20F360A0").move.feed_mm_s == pytest.approx(6, rel=1e-6)
    assert six.run("X0A90").move.feed_mm_s == pytest.approx(6, rel=1e-6), "X does not move"
    assert six.run("X1A0").move.feed_mm_s == c_float(360 * 25.4 / 60).value


def test_inverse_time(cnc: Controller) -> None:
    cnc.run("F600")
    move = cnc.run("G93G1X1F30").move
    assert (move.inverse_time_s, move.feed_mm_s) == (2, 0)
    assert cnc.run("G20X1F120").move.inverse_time_s == 0.5
    assert cnc.answer("X3") == 22, "each line needs its F"
    assert cnc.answer("X3F0") == 22
    assert cnc.run("G0X5").move.inverse_time_s == 0, "a rapid needs none"
    assert cnc.run("G28X0").move.inverse_time_s == 0
    assert cnc.answer("G94G1X4") == 22, "and going back needs one"
    assert cnc.run("G21G94G1X4F60").move.feed_mm_s == 1
    cnc.run("G93")
    assert cnc.answer("G94", "G1X4") == 22


# -- offsets


def test_g10_l20_subtracts_g92_and_tool_length(cnc: Controller) -> None:
    """`G10L20P1Z0` with G43.1 Z2 active, at machine 0, stored -2.000."""
    command = cnc.run("G43.1Z2", "G10L20P1Z0")
    assert (command.store, command.store_wcs, list(command.store_mm)[:3]) == (STORE_WCS, 0, [0, 0, -2])
    cnc.run("G0Z0")
    assert cnc.position()[2] == 0


@pytest.mark.parametrize("p", range(7))
def test_g10_p_selects_the_wcs(cnc: Controller, p: int) -> None:
    command = cnc.run("G0X10", "G57", f"G10L20P{p}X4")
    assert command.store_wcs == (p - 1 if p else 3)
    assert cnc.state.offsets.wcs_mm[command.store_wcs][0] == 6
    assert sum(row[0] != 0 for row in cnc.state.offsets.wcs_mm) == 1
    assert command.move.motion == NO_MOTION


def test_g10_keeps_other_axes_and_ignores_g91(cnc: Controller) -> None:
    cnc.run("G10L2P1X1Y2Z3", "G91", "G10L2P1Y5")
    assert list(cnc.state.offsets.wcs_mm[0])[:3] == [1, 5, 3]


def test_g92_makes_the_position_read(cnc: Controller) -> None:
    cnc.run("G10L2P1X100", "G43.1Z2", "G0X5Z7")
    assert cnc.position() == [105, 0, 9]
    command = cnc.run("G92X0Z1")
    assert (command.store, command.move.motion) == (STORE_G92, NO_MOTION)
    cnc.run("G0X0Z1")
    assert cnc.position() == [105, 0, 9]
    cnc.run("G92.1", "G0X5Z7")
    assert cnc.position() == [105, 0, 9]
    cnc.run("G20G92X1", "G21G0X25.4")
    assert cnc.position()[0] == 105


def test_tool_length(cnc: Controller) -> None:
    command = cnc.run("G20G43.1Z1")
    assert (command.store_tool_length, command.tool_length_mm, command.store) == (True, 25.4, STORE_NOTHING)
    command = cnc.run("G92.1G49")
    assert (command.store_tool_length, command.tool_length_mm, command.store) == (True, 0, STORE_G92)
    assert cnc.state.offsets.tool_length_mm == 0


def test_g28_goes_through_a_point(cnc: Controller) -> None:
    cnc.run("G0X1Y2Z3", "G28.1", "G0X10Y20Z30", "G30.1")
    move = cnc.run("G28").move
    assert (move.motion, move.via, list(move.target_mm)[:3]) == (RAPID, False, [1, 2, 3])
    cnc.run("G0X9Y9Z9", "G1F100")
    move = cnc.run("G91G30Z5").move
    assert (move.motion, move.via) == (RAPID, True)
    assert list(move.via_mm)[:3] == [9, 9, 14]
    assert list(move.target_mm)[:3] == [9, 9, 30]
    assert cnc.state.modal.motion == LINEAR, "G30 is not modal"


def test_g28_1_stores_before_it_moves(cnc: Controller) -> None:
    command = cnc.run("G0X1", "G28.1X5")
    assert (command.store, command.store_mm[0], command.move.target_mm[0]) == (STORE_G28, 1, 5)


# -- modes


def test_initial_modes(cnc: Controller) -> None:
    modal = cnc.state.modal
    assert (modal.motion, modal.plane, modal.path, modal.feed_mode) == (RAPID, XY, BLEND, PER_MIN)
    assert not (modal.inches or modal.incremental or modal.arc_absolute or modal.wcs or modal.coolant)
    assert (modal.spindle, modal.tool, modal.feed_mm_s, modal.spindle_rpm) == (SPINDLE_OFF, 0, 0, 0)


@pytest.mark.parametrize(
    ("line", "field", "value"),
    [
        ("G80", "motion", NO_MOTION),
        ("G18", "plane", ZX),
        ("G19", "plane", YZ),
        ("G91", "incremental", True),
        ("G90.1", "arc_absolute", True),
        ("G20", "inches", True),
        ("G59", "wcs", 5),
        ("G61", "path", EXACT),
        ("G61.1", "path", EXACT_STOP),
        ("M3", "spindle", SPINDLE_CW),
        ("M4", "spindle", SPINDLE_CCW),
        ("M7", "coolant", MIST),
        ("M8", "coolant", FLOOD),
        ("T5", "tool", 5),
        ("T1.5", "tool", 1),
        ("S1000.5", "spindle_rpm", 1000.5),
    ],
)
def test_mode(cnc: Controller, line: str, field: str, value: object) -> None:
    assert getattr(cnc.state.modal, field) != value
    cnc.run(line)
    assert getattr(cnc.state.modal, field) == value
    cnc.run("G4P0", "N1")
    assert getattr(cnc.state.modal, field) == value, "modal"


def test_codes_that_lead_back(cnc: Controller) -> None:
    start = bytes(cnc.state)
    cnc.run("G18G91G90.1G20G57G61M3M8G93", "G17G90G91.1G21G54G64M5M9G94")
    assert bytes(cnc.state) == start


def test_t_is_kept(cnc: Controller) -> None:
    """T resets to 0 in the next block in Grbl: `a sane firmware keeps it`."""
    cnc.run("T5", "G0X0")
    assert cnc.state.modal.tool == 5


def test_path_tolerance(cnc: Controller) -> None:
    cnc.run("G20G64P0.1")
    assert cnc.state.modal.path_tolerance_mm == pytest.approx(2.54)
    cnc.run("G61", "G21")
    cnc.run("G64")
    assert cnc.state.modal.path_tolerance_mm == 0
    command = cnc.run("G4P2G64")
    assert (command.dwell_s, cnc.state.modal.path_tolerance_mm) == (2, 0)
    cnc.run("G10L2P3X1G64")
    assert cnc.state.modal.path_tolerance_mm == 0


def test_coolants_add_up(cnc: Controller) -> None:
    cnc.run("M7", "M8")
    assert cnc.state.modal.coolant == MIST | FLOOD
    cnc.run("M9")
    assert cnc.state.modal.coolant == 0


def test_spindle_and_coolant_changes_synchronise(cnc: Controller) -> None:
    expected = {
        "S100": False,
        "M3": True,
        "G0X1": False,
        "M3S100": False,
        "S200": True,
        "M8": True,
        "M8G0X2": False,
        "M9": True,
        "M5": True,
        "S300": False,
    }
    assert {line: cnc.run(line).sync for line in expected} == expected


def test_program_end(cnc: Controller) -> None:
    """M2/M30: motion G1, G17 G90 G94 G54 M5 M9; S stays displayed."""
    for end in ("M2", "M30"):
        cnc.run("G2G18G91G93G55G20M3M8S500T4F1X0I0")
        command = cnc.run(end)
        modal = cnc.state.modal
        assert command.flow == END
        assert (modal.motion, modal.plane, modal.feed_mode) == (LINEAR, XY, PER_MIN)
        assert (modal.incremental, modal.wcs) == (False, 0)
        assert (modal.spindle, modal.coolant, modal.spindle_rpm) == (SPINDLE_OFF, 0, 500)
        assert (modal.inches, modal.tool) == (True, 4)


def test_the_spindle_stops_after_the_last_move(cnc: Controller) -> None:
    cnc.run("M3S100M8")
    command = cnc.run("G0X1M30")
    assert (command.spindle, command.coolant, command.sync) == (SPINDLE_CW, FLOOD, False)
    assert (command.next.spindle, command.next.coolant, command.move.motion) == (SPINDLE_OFF, 0, RAPID)


def test_flow(cnc: Controller) -> None:
    flows = {"G0": RUN, "M0": PAUSE, "M1": OPTIONAL_PAUSE, "M2": END, "M30": END}
    assert {line: cnc.run(line).flow for line in flows} == flows


def test_dwell_and_line_number(cnc: Controller) -> None:
    command = cnc.run("N42G4P1.5")
    assert (command.dwell_s, command.line_number) == (1.5, 42)
    command = cnc.run("G0X1")
    assert (command.line_number, command.dwell_s < 0) == (0, True)
    assert cnc.run("N7.9").line_number == 7


@pytest.mark.parametrize("kind", [2, 3, 4, 5])
def test_probe(cnc: Controller, kind: int) -> None:
    cnc.run("F60")
    move = cnc.run(f"G38.{kind}Z-5").move
    assert (move.motion, move.probe, move.target_mm[2], move.feed_mm_s) == (PROBE, kind, -5, 1)
    assert cnc.state.modal.probe == kind
    assert cnc.run("Z-6").move.probe == kind, "modal"
    assert cnc.run("G0Z0").move.probe == 0


def test_motion_is_modal_and_optional(cnc: Controller) -> None:
    assert cnc.run("X1").move.motion == RAPID
    assert cnc.run("G1F1").move.motion == NO_MOTION
    assert cnc.run("X2").move.motion == LINEAR
    assert cnc.run("G0").move.motion == NO_MOTION
    assert cnc.run("G53").move.motion == NO_MOTION


# -- arcs


def center(cnc: Controller, *lines: str) -> list[float]:
    return list(cnc.run(*lines).move.center_mm)


@pytest.mark.parametrize(
    ("plane", "line"),
    [(XY, "G17G2X10Y0I5J0"), (ZX, "G18G2Z10X0K5I0"), (YZ, "G19G2Y10Z0J5K0")],
)
def test_centre_is_in_plane_order(cnc: Controller, plane: int, line: str) -> None:
    """G18 is Z, X: the order that makes counter-clockwise right-handed."""
    move = cnc.run("F100", line).move
    assert (move.plane, list(move.center_mm), move.turns) == (plane, [5, 0], 0)


def test_centre_follows_the_start(cnc: Controller) -> None:
    assert center(cnc, "F100G0X10Y20", "G2X12I1") == [11, 20]
    assert center(cnc, "G20G91G3X0I1") == pytest.approx([12 + 25.4, 20])


def test_absolute_centre(cnc: Controller) -> None:
    cnc.run("G10L2P1X100Y50", "G0X10Y0", "F100G90.1")
    assert center(cnc, "G2X0Y10I0J0") == [100, 50]
    assert center(cnc, "G91.1G2X10Y0J-10") == [100, 50]


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("G2X10Y0R5", [5, 0]),
        ("G3X10Y0R5", [5, 0]),
        ("G2X10Y10R10", [10, 0]),
        ("G3X10Y10R10", [0, 10]),
        ("G2X10Y10R-10", [0, 10]),
        ("G3X10Y10R-10", [10, 0]),
        ("G20G3X10Y10R10", [0, 254]),
    ],
)
def test_centre_from_radius(cnc: Controller, line: str, expected: list[float]) -> None:
    assert center(cnc, "F100", line) == pytest.approx(expected, abs=1e-12)


@given(st.floats(0, 2 * math.pi), st.integers(1, 999_999))
def test_half_circles_by_radius_are_forgiven_their_rounding(lib: CDLL, angle: float, um: int) -> None:
    """`An R arc of exactly half the chord gives error:34 in real Grbl depending on rounding`."""
    cnc = Controller(lib)
    radius = um / 1000
    x, y = 2 * radius * math.cos(angle), 2 * radius * math.sin(angle)
    x, y = round(x, 3), round(y, 3)
    if math.hypot(x, y) > 0:
        found = center(cnc, "F100", f"G2X{x:.3f}Y{y:.3f}R{radius:.3f}")
        tolerance = math.sqrt(2 * (radius + 0.002) * 0.002) + 0.001
        assert found == pytest.approx([x / 2, y / 2], abs=tolerance)


def test_radius_too_short(cnc: Controller) -> None:
    assert cnc.answer("F100", "G2X10Y0R4.996") == 0
    cnc.run("G0X0")
    assert cnc.answer("G2X10Y0R4.994") == 34
    assert cnc.answer("G2X0.001Y0R0") == 34


@pytest.mark.parametrize(
    ("line", "answer"),
    [
        ("G2X10Y0I5.0025", 0),  # the radii differ by 0.005
        ("G2X10Y0I5.0026", 33),  # by 0.0052, more than 0.1 % of 5
        ("G2X1000.9Y0I500", 33),  # by 0.9
        ("G2X1000.4Y0I500", 0),  # by 0.4, less than 0.1 % of 500
        ("G2X2001.2Y0I1000", 33),  # by 1.2
        ("G2X2000.6Y0I1000", 33),  # by 0.6: less than 0.1 % but more than 0.5
    ],
)
def test_off_radius(cnc: Controller, line: str, answer: int) -> None:
    """Radii differ by more than 0.5 mm, or by more than 0.005 mm and 0.1 %."""
    assert cnc.answer("F100", line) == answer


def test_largest_radius(cnc: Controller) -> None:
    assert cnc.answer("F100", "G2X1Y1R10000000") == 0
    assert cnc.answer("G2X2Y2R10000001") == 33
    assert cnc.answer("G3X2Y2R999999999999999999") == 33
    assert cnc.answer("G3X2Y2I999999999999999999") == 33


@pytest.mark.parametrize(("axes", "line"), [(0b1, "G17G2X5I5"), (0b11, "G18G3X5I5"), (0b11, "G19G2Y5R9")])
def test_an_arc_needs_both_axes_of_its_plane(lib: CDLL, axes: int, line: str) -> None:
    """An axis that the machine has not would have to move."""
    cnc = Controller(lib, axes)
    assert cnc.answer("F100", line) == 20
