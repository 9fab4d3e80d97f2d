"""protocol/settings.toml: what the Python view refuses, and the wire and storage names against their specification."""

from __future__ import annotations

import pytest
from pydantic import ValidationError
from settings_core import AXES, NUMBERS, TABLE
from wificnc.tables import AXES as AXIS_LETTERS
from wificnc.tables import load_settings
from wificnc.tables.settings import parse_settings

GOOD = {
    "number": "7",
    "name": '"dwell_ms"',
    "type": '"u16"',
    "unit": '"ms"',
    "default": "5",
    "min": "1",
    "max": "10",
    "help": '"A pause."',
    "affects": '["motion"]',
    "nvs": '"dwell_ms"',
}
GOOD_FLOAT = {"type": '"float"', "default": "5.0", "decimals": "3"}

# Keys and storage names of the controllers in the field; their clients know them.
WIRE_KEYS = {
    "steps_per_mm": (0x0001, "float"),
    "max_rate_mm_min": (0x0010, "u32"),
    "acceleration_mm_s2": (0x0020, "u32"),
    "step_pulse_us": (0x0100, "u16"),
    "status_interval_ms": (0x0103, "u16"),
    "host_timeout_ms": (0x0800, "u16"),  # ours
    "host_hold_on_gap": (0x0801, "u8"),  # ours
    "sender_lost": (0x0802, "u8"),  # ours
    "idle_delay_ms": (0x0102, "u16"),
    "step_invert_mask": (0x0300, "u8"),
    "dir_invert_mask": (0x0301, "u8"),
    "enable_invert": (0x0302, "u8"),
    "limit_invert": (0x0310, "u8"),
    "probe_invert": (0x0313, "u8"),
    "homing_dir_mask": (0x0320, "u8"),
    "homing_seek_mm_min": (0x0321, "u32"),
    "homing_feed_mm_min": (0x0322, "u32"),
    "homing_pull_off_mm": (0x0323, "u32"),
    "charge_pump_hz": (0x0400, "u16"),
    "pwm_hz": (0x0430, "u16"),
    "spindle_max_rpm": (0x0431, "u32"),
}
NVS_KEYS = {
    "step_pulse_us": "pulse_us",
    "idle_delay_ms": "idle_ms",
    "step_invert_mask": "inv_step",
    "dir_invert_mask": "inv_dir",
    "enable_invert": "inv_en",
    "limit_invert": "inv_lim",
    "probe_invert": "inv_prb",
    "junction_deviation_mm": "junc_dev",
    "arc_tolerance_mm": "arc_tol",
    "homing_dir_mask": "hm_dir",
    "homing_feed_mm_min": "hm_feed",
    "homing_seek_mm_min": "hm_seek",
    "homing_pull_off_mm": "hm_pull",
    "jerk_mm_s3": "jerk_max",
    "arc_radius_tolerance_mm": "arc_radius",
    "steps_per_mm": "spm_{axis}",
    "max_rate_mm_min": "rate_{axis}",
    "acceleration_mm_s2": "acc_{axis}",
    "max_travel_mm": "trvl_{axis}",
}


def table(*rows: dict[str, str]) -> str:
    """TOML of a table of these rows, each GOOD but for what it says."""
    text = ["schema = 1"]
    for row in rows:
        merged = {**GOOD, **row}
        text += ["[[setting]]", *(f"{key} = {value}" for key, value in merged.items() if value)]
    return "\n".join(text)


def test_a_good_row_is_read() -> None:
    (row,) = parse_settings(table({})).setting
    assert (row.number, row.default, row.min, row.max, row.count, row.text(row.default)) == (7, 5, 1, 10, 1, "5")


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"default": "11"}, "the default is out of range"),
        ({"default": "0"}, "the default is out of range"),
        ({"min": "-1"}, "min must be 0 or more"),
        ({"min": "10", "default": "10"}, "less than max"),
        ({"default": "true"}, "only a bool"),
        ({"type": '"bool"', "min": "", "max": "", "default": "1"}, "only a bool"),
        ({"type": '"u8"', "max": "256"}, "does not fit u8"),
        ({"max": "65536"}, "does not fit u16"),
        ({**GOOD_FLOAT, "max": "10.1"}, "single-precision"),
        ({**GOOD_FLOAT, "max": "inf"}, "finite"),
        ({"type": '"u64"'}, "'bool', 'u8', 'u16' or 'float'"),
        ({"nvs": '"sixteen_letters_"'}, "longer than 15"),
        ({"per_axis": "true", "nvs": '"fifteen_letter_{axis}"'}, "longer than 15"),
        ({"wire": "{ key = 0, type = 'u8' }"}, "greater than or equal to 1"),
        ({"wire": "{ key = 1, type = 'u9' }"}, "'u8'"),
        ({"name": '"Dwell"'}, "pattern"),
        ({"decimal": "3"}, "Extra inputs"),
        ({"help": ""}, "Field required"),
        ({"help": f'"{"x" * 96}"'}, "at most 95"),
    ],
)
def test_a_bad_row_is_refused(change: dict[str, str], reason: str) -> None:
    with pytest.raises(ValidationError, match=reason):
        parse_settings(table(change))


@pytest.mark.parametrize(
    ("first", "second", "reason"),
    [
        ({"number": "7"}, {"number": "7", "name": '"other"'}, "must come after"),
        ({"number": "8"}, {"number": "7", "name": '"other"'}, "must come after"),
        ({"number": "1", "per_axis": "true"}, {"number": "6", "name": '"other"'}, "must come after"),
        ({"number": "1"}, {"number": "2"}, "same name"),
        ({"number": "1"}, {"number": "2", "name": '"other"'}, "same nvs key"),
    ],
)
def test_rows_that_clash_are_refused(first: dict[str, str], second: dict[str, str], reason: str) -> None:
    with pytest.raises(ValidationError, match=reason):
        parse_settings(table(first, second))


def test_an_axis_row_may_be_followed_at_once() -> None:
    parse_settings(
        table(
            {"number": "1", "per_axis": "true", "nvs": '"dwell_{axis}"'},
            {"number": "7", "name": '"other"', "nvs": '"other"'},
        )
    )


def test_rows_are_found_by_name() -> None:
    settings = load_settings()
    assert settings["max_rate_mm_min"].number == 110
    with pytest.raises(KeyError):
        settings["max_rate"]


def test_axes_are_the_cores() -> None:
    assert len(AXIS_LETTERS) == AXES


def test_wire_keys_are_those_in_the_field() -> None:
    assert {row["name"]: (row["wire"]["key"], row["wire"]["type"]) for row in TABLE if "wire" in row} == WIRE_KEYS


def test_storage_names_are_those_in_the_field() -> None:
    assert NVS_KEYS.items() <= {row["name"]: row["nvs"] for row in TABLE}.items()


def test_no_two_settings_lie_under_one_storage_key() -> None:
    keys = [row["nvs"].format(axis=axis) for row in TABLE for axis in ("xyzabc" if row.get("per_axis") else "x")]
    assert len(set(keys)) == len(keys)


def test_a_counter_of_32_bits_holds_every_position() -> None:
    longest = load_settings()["max_travel_mm"].max * load_settings()["steps_per_mm"].max
    assert longest < 2**31


def test_all_of_grbl_and_six_axes_are_there() -> None:
    grbl = {*range(7), *range(10, 14), *range(20, 28), *range(30, 33)}
    axes = {base + index for base in (100, 110, 120, 130) for index in range(6)}
    assert {item.number for item in NUMBERS} >= grbl | axes
