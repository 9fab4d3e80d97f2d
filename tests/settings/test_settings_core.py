"""core/settings against protocol/settings.toml, and against what Grbl 1.1h answers."""

from __future__ import annotations

import ctypes
import math
import re
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st
from looped import looped
from settings_core import AXES, NUMBERS, ROOT, TABLE, Numbered, Row, Settings, Values

OK, BAD_NUMBER, UNKNOWN, NEGATIVE, STEP_PULSE, NEEDS_HOMING = 0, 2, 3, 4, 6, 10  # Grbl's numbers
ORDER_OF_TYPES = ["bool", "u8", "u16", "float"]

# Grbl 1.1h after $RST=$ (its generic defaults), but $0 of the seed firmware, and what Grbl does not have:
# $33 to $36 and $40 to $98.
GRBL_REPORT = """
$0=3 $1=25 $2=0 $3=0 $4=0 $5=0 $6=0 $10=1 $11=0.010 $12=0.002 $13=0 $20=0 $21=0 $22=0 $23=0 $24=25.000 $25=500.000
 $26=250 $27=1.000 $30=1000 $31=0 $32=0 $33=5000 $34=0.0 $35=0.0 $36=100.0 $40=0.000 $41=0.000
 $44=4 $45=3 $46=0 $47=0 $48=0 $49=0 $74=1 $75=5.0 $76=50 $77=2000
 $78=1 $80=0 $81=50.000 $82=50.000 $83=0 $84=200 $85=0 $86=1000 $87=2000 $88=0 $89=0 $90=30 $91=1 $92=5 $93=0.0
$94=20 $95=40 $96=60 $97=80 $98=0
 $100=250.000 $101=250.000 $102=250.000
$110=500.000 $111=500.000 $112=500.000 $120=10.000 $121=10.000 $122=10.000 $130=200.000 $131=200.000 $132=200.000
$340=0 $394=0.0 $539=0.0
"""

each_number = looped("item", NUMBERS, lambda item: f"${item.number}", settings=lambda library: Settings(library))


def single(value: float) -> float:
    """Rounded to single precision."""
    return float(struct.unpack("<f", struct.pack("<f", value))[0])


def field(settings: Settings, item: Numbered) -> float:
    value = getattr(settings.values, item.row["name"])
    return float(value[item.index] if item.row.get("per_axis") else value)


# setting -> others and the values of them that allow any value of the first
NEEDS = {20: [(22, 1)], 32: [(34, 0), (395, 0)], 34: [(32, 0)], 35: [(36, 100)], 36: [(35, 0)], 395: [(32, 0)]}
MICROSTEPS = range(150, 156)  # powers of two
LOWEST, HIGHEST = ({number: number - 94 + first for number in range(94, 98)} for first in (1, 96))
for number in LOWEST:  # which ascend
    below, above = range(94, number), range(97, number, -1)
    NEEDS[number] = [(n, LOWEST[n]) for n in below] + [(n, HIGHEST[n]) for n in above]


def ready(settings: Settings, item: Numbered) -> None:
    """Bring the settings to where this one may be set to anything in its range."""
    for number, value in NEEDS.get(item.number, []):
        assert settings.set(number, value) == OK


# --- the table -----------------------------------------------------------------------------------------------------


def test_descriptor_table_is_the_toml_table(settings: Settings) -> None:
    rows = (Row * len(TABLE)).in_dll(settings.library, "setting_rows")
    codes = {
        name: int(code)
        for code, name in re.findall(r"X\((\d+), (\w+),", (ROOT / "core/gcode/status.h").read_text(encoding="utf-8"))
    }
    for row, want in zip(rows, TABLE, strict=True):
        assert row.number == want["number"]
        assert row.offset == getattr(Values, want["name"]).offset
        assert ORDER_OF_TYPES[row.type] == want["type"]
        assert row.count == (AXES if want.get("per_axis") else 1)
        assert row.decimals == want.get("decimals", 0)
        assert row.below == codes[want.get("below", "BAD_NUMBER")]
        assert (row.min, row.max) == (single(want.get("min", 0)), single(want.get("max", 1)))
        assert row.fallback == single(want["default"])


@each_number
def test_default_is_in_its_field_and_in_range(settings: Settings, item: Numbered) -> None:
    assert field(settings, item) == single(item.row["default"])
    assert item.min <= item.row["default"] <= item.max


def test_defaults_overwrite_everything_and_nothing_else(settings: Settings) -> None:
    guarded = (ctypes.c_uint8 * (ctypes.sizeof(Values) + 64))(*[0xA5] * (ctypes.sizeof(Values) + 64))
    settings.library.settings_defaults(ctypes.cast(guarded, ctypes.POINTER(Values)))
    assert bytes(guarded)[ctypes.sizeof(Values) :] == b"\xa5" * 64
    found = Values.from_buffer(guarded)
    for name, _ in Values._fields_:
        left, right = getattr(found, name), getattr(settings.values, name)
        assert (list(left) == list(right)) if isinstance(left, ctypes.Array) else left == right


# --- the report ----------------------------------------------------------------------------------------------------


def test_report_of_defaults_is_grbls(settings: Settings) -> None:
    known = {line.split("=")[0] for line in GRBL_REPORT.split()}
    assert [line for line in settings.report(axes=3) if line.split("=")[0] in known] == GRBL_REPORT.split()


@pytest.mark.parametrize("axes", [0, 1, 3, 6, 7, 255])
def test_walk_is_ascending_and_stops_at_the_machines_axes(settings: Settings, axes: int) -> None:
    expected = [item.number for item in NUMBERS if not item.row.get("per_axis") or item.index < axes]
    assert list(settings.walk(axes)) == expected == sorted(expected)


def test_end_of_the_walk_leaves_the_number(settings: Settings) -> None:
    end = max(item.number for item in NUMBERS)
    for last in (end, end + 1, 0xFFFE):
        number = ctypes.c_uint16(last)
        assert not settings.library.settings_next(ctypes.byref(number), AXES)
        assert number.value == last


def test_count_constant_is_the_length_of_the_walk(settings: Settings) -> None:
    header = (ROOT / "core/settings/settings_gen.h").read_text(encoding="utf-8")
    found = re.search(r"SETTINGS_COUNT = (\d+)", header)
    assert found and int(found[1]) == len(list(settings.walk()))


# --- setting one ---------------------------------------------------------------------------------------------------


@each_number
@pytest.mark.parametrize("others", ["low", "high"])
def test_a_number_changes_its_own_field_only(settings: Settings, item: Numbered, others: str) -> None:
    settings.set(22, 1)
    for other in NUMBERS:
        if other.number != 22:
            ready(settings, other)
            assert settings.set(other.number, other.max if others == "high" else other.min) == OK
    ready(settings, item)
    before = {other.number: settings.value(other.number) for other in NUMBERS}
    new = item.min if before[item.number] == item.max else item.max
    assert settings.set(item.number, new) == OK
    assert field(settings, item) == single(new)
    changed = {number for number, value in before.items() if settings.value(number) != value}
    assert changed == ({20, 22} if item.number == 22 and others == "high" else {item.number})


@each_number
def test_both_ends_of_the_range_are_inside(settings: Settings, item: Numbered) -> None:
    ready(settings, item)
    for value in (item.min, item.max):
        assert settings.set(item.number, value) == OK
        assert settings.value(item.number) == single(value)


@each_number
def test_outside_the_range_is_refused_and_changes_nothing(settings: Settings, item: Numbered) -> None:
    ready(settings, item)
    above = 256 if item.row["type"] == "bool" else item.max * 1.0001 if item.is_float else item.max + 1
    below = item.min * 0.999 if item.is_float else item.min - 1
    before = settings.image()
    assert settings.set(item.number, above) == BAD_NUMBER
    if item.min > 0:
        assert settings.set(item.number, below) == (STEP_PULSE if item.number == 0 else BAD_NUMBER)
    assert settings.image() == before


@each_number
@pytest.mark.parametrize(
    ("value", "status"),
    [
        (math.nan, BAD_NUMBER),
        (math.inf, BAD_NUMBER),
        (1e300, BAD_NUMBER),
        (2.0**32, BAD_NUMBER),
        (-math.inf, NEGATIVE),
        (-1e300, NEGATIVE),
        (-1.0, NEGATIVE),
        (-5e-324, NEGATIVE),
    ],
)
def test_no_such_number_gets_in(settings: Settings, item: Numbered, value: float, status: int) -> None:
    before = settings.image()
    assert settings.set(item.number, value) == status
    assert settings.image() == before


def test_unknown_numbers(settings: Settings) -> None:
    known = {item.number for item in NUMBERS}
    before = settings.image()
    for number in set(range(0x10000)) - known:
        assert settings.set(number, 1) == UNKNOWN
        assert settings.get(number) is None
    assert settings.image() == before


@pytest.mark.parametrize("number", [100, 110, 120, 130])
def test_axes_the_machine_has_not_are_unknown(settings: Settings, number: int) -> None:
    assert settings.set(number + 2, 5, axes=3) == OK
    assert settings.get(number + 2, axes=3) is not None
    assert settings.set(number + 3, 5, axes=3) == UNKNOWN
    assert settings.get(number + 3, axes=3) is None
    assert settings.set(number + 6, 5, axes=255) == UNKNOWN


def test_unknown_goes_before_a_bad_value(settings: Settings) -> None:
    assert settings.set(999, math.nan) == UNKNOWN


@pytest.mark.parametrize(
    ("number", "given", "kept"),
    [(0, 3.999, 3), (1, 255.9, 255), (2, 63.99, 63), (26, 0.5, 0), (4, 0.99, 0), (4, 1.5, 1), (5, 7, 1), (32, 255, 1)],
)
def test_whole_numbers_drop_the_fraction_as_grbl_does(
    settings: Settings, number: int, given: float, kept: float
) -> None:
    assert settings.set(number, given) == OK
    assert settings.value(number) == kept


def test_no_step_pulse_at_all_is_error_6(settings: Settings) -> None:
    assert settings.set(0, 0) == STEP_PULSE
    assert settings.set(0, 0.999) == STEP_PULSE
    assert settings.set(0, 1) == OK


def test_minus_zero_is_kept_as_zero(settings: Settings) -> None:
    for number in (11, 40, 130):
        assert settings.set(number, -0.0) == OK
        assert math.copysign(1, settings.value(number)) == 1


# --- rules between settings ----------------------------------------------------------------------------------------


def test_soft_limits_need_homing(settings: Settings) -> None:
    before = settings.image()
    assert settings.set(20, 1) == NEEDS_HOMING
    assert settings.image() == before
    assert settings.set(20, 0) == OK
    assert settings.set(22, 1) == OK
    assert settings.set(20, 1) == OK
    assert settings.value(20) == 1


@pytest.mark.parametrize(
    ("first", "then", "status"),
    [
        ((32, 1), (34, 0.1), 161),
        ((34, 0.1), (32, 1), 161),
        ((36, 50), (35, 49.1), 160),
        ((36, 50), (35, 50), 160),
        ((35, 50), (36, 50.9), 160),
        ((35, 50), (36, 20), 160),
        ((36, 50), (35, 49), OK),
        ((34, 30), (35, 20), OK),  # off may be anywhere
    ],
)
def test_rules_of_the_pwm(settings: Settings, first: tuple[int, float], then: tuple[int, float], status: int) -> None:
    """A laser is dark when it is off, and its least and full power differ."""
    assert settings.set(*first) == OK
    before = settings.image()
    assert settings.set(*then) == status
    assert (settings.image() == before) == (status != OK)


@pytest.mark.parametrize(
    ("number", "value", "status"),
    [
        (94, 39, OK),
        (94, 40, 163),
        (95, 20, 163),
        (95, 60, 163),
        (96, 59.9, OK),
        (96, 40, 163),
        (97, 60, 163),
        (97, 61, OK),
    ],
)
def test_the_laser_curve_ascends(settings: Settings, number: int, value: float, status: int) -> None:
    before = settings.image()
    assert settings.set(number, value) == status
    assert (settings.image() == before) == (status != OK)


def test_homing_off_switches_soft_limits_off(settings: Settings) -> None:
    assert [settings.set(22, 1), settings.set(20, 1), settings.set(22, 0)] == [OK] * 3
    assert (settings.value(20), settings.value(22)) == (0, 0)
    assert settings.set(22, 1) == OK
    assert settings.value(20) == 0


# --- properties ----------------------------------------------------------------------------------------------------


def in_range(item: Numbered) -> st.SearchStrategy[tuple[Numbered, float]]:
    if item.number in MICROSTEPS:
        return st.tuples(st.just(item), st.sampled_from([float(1 << power) for power in range(9)]))
    return st.tuples(st.just(item), st.floats(item.min, item.max))


@given(st.sampled_from(NUMBERS).flatmap(in_range))
def test_what_was_set_is_got(library: ctypes.CDLL, pair: tuple[Numbered, float]) -> None:
    item, value = pair
    settings = Settings(library)
    ready(settings, item)
    assert settings.set(item.number, value) == OK
    assert settings.value(item.number) == (single(value) if item.is_float else math.trunc(value))


@given(st.sampled_from(NUMBERS).flatmap(in_range))
def test_a_printed_value_typed_again_prints_the_same(library: ctypes.CDLL, pair: tuple[Numbered, float]) -> None:
    item, value = pair
    settings = Settings(library)
    ready(settings, item)
    assert settings.set(item.number, value) == OK
    first = settings.report()
    shown = {int(number): float(text) for number, text in (line[1:].split("=") for line in first)}
    assert settings.set(item.number, shown[item.number]) == OK
    assert settings.report() == first


@given(st.lists(st.tuples(st.sampled_from([item.number for item in NUMBERS]), st.floats(width=64))))
def test_nothing_that_is_typed_leaves_the_ranges_or_breaks_the_rules(
    library: ctypes.CDLL, typed: list[tuple[int, float]]
) -> None:
    settings = Settings(library)
    for number, value in typed:
        before = settings.image()
        if settings.set(number, value) != OK:
            assert settings.image() == before
    for item in NUMBERS:
        assert single(item.min) <= settings.value(item.number) <= item.max
    assert settings.value(22) or not settings.value(20)
    assert settings.value(34) == 0 or not settings.value(32)
    assert settings.value(36) - settings.value(35) >= 1
    assert settings.value(94) < settings.value(95) < settings.value(96) < settings.value(97)
