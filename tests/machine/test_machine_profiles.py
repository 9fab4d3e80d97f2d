"""Machine profiles: what is read, and the lines that follow from it."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from wificnc.board.load import load_board
from wificnc.errors import MachineError, UserError
from wificnc.profile import Machine, find_machines, load_machine
from wificnc.profile.fit import check_fit
from wificnc.profile.model import _text

FULL = """
schema = 1
name = "Everything"

[axis.x]
steps_per_mm = 100
max_rate_mm_min = 5000.5
acceleration_mm_s2 = 400
travel_mm = 300
invert_direction = true
home_at = "min"

[axis.z]
steps_per_mm = 314.960629921
max_rate_mm_min = 1000
acceleration_mm_s2 = 50
travel_mm = 80
invert_step = true
home_at = "max"

[axis.a]
steps_per_deg = 8.8888888889
max_rate_deg_min = 7200
acceleration_deg_s2 = 360

[motion]
junction_deviation_mm = 0.0125
arc_tolerance_mm = 0.002
jerk_mm_s3 = 100000
arc_radius_tolerance_mm = 0.25

[stepper]
step_pulse_us = 5
idle_delay_ms = 255
enable_active_high = true

[limits]
soft = true
hard = false
active_high = true

[homing]
enabled = true
feed_mm_min = 50
seek_mm_min = 800
debounce_ms = 25
pull_off_mm = 1.5

[probe]
active_high = false

[spindle]
max_rpm = 24000
min_rpm = 6000
laser = false
"""

FULL_LINES = """
$22=1 $0=5 $1=255 $2=4 $3=1 $4=1 $5=1 $6=0 $11=0.0125000 $12=0.002 $20=1 $21=0 $23=1 $24=50.000 $25=800.000
$26=25 $27=1.500 $30=24000.000 $31=6000.000 $32=0 $40=100000.000 $41=0.250 $44=4 $45=1 $46=0
$47=0 $48=0 $49=0 $79=4 $100=100.000 $102=314.96063 $103=8.8888889
$110=5000.500 $112=1000.000 $113=7200.000 $120=400.000 $122=50.000 $123=360.000 $130=300.000 $132=80.000 $133=0.000
"""

AXIS_X = "[axis.x]\nsteps_per_mm = 80\nmax_rate_mm_min = 6000\nacceleration_mm_s2 = 500\n"
SMALL = f'schema = 1\nname = "Small"\n{AXIS_X}'


def load(folder: Path, text: str) -> Machine:
    file = folder / "machine.toml"
    file.write_text(text, encoding="utf-8")
    return load_machine(file)


def test_every_key_becomes_its_setting_and_homing_comes_first(tmp_path: Path) -> None:
    assert load(tmp_path, FULL).settings_lines() == FULL_LINES.split()


def test_what_a_profile_leaves_out_is_not_set(tmp_path: Path) -> None:
    assert load(tmp_path, SMALL).settings_lines() == ["$79=1", "$100=80.000", "$110=6000.000", "$120=500.000"]


@pytest.mark.parametrize(
    ("profile", "cycles"), [("shapeoko3", [4, 3, 0, 0, 0, 0]), ("sherline_5400", [4, 3, 0, 0, 0, 0])]
)
def test_homing_seeks_the_axes_of_the_profile(profile: str, cycles: list[int]) -> None:
    """A board may have more axes than the machine: `$H` seeks no switch that is not there."""
    settings = load_machine(profile).settings()
    assert [settings[number] for number in range(44, 50)] == cycles


def test_a_profile_may_say_the_order_of_homing(tmp_path: Path) -> None:
    """Axes that no cycle names have no switch."""
    settings = load(tmp_path, FULL.replace("[homing]\n", '[homing]\norder = ["X", "Z"]\n')).settings()
    assert [settings[number] for number in range(44, 50)] == [1, 4, 0, 0, 0, 0]


def test_pwm_and_the_delay_of_coolant(tmp_path: Path) -> None:
    text = "[spindle]\npwm_hz = 1000\npwm_min_pct = 5\npwm_max_pct = 95\n[coolant]\ndelay_s = 1.5\n"
    assert load(tmp_path, SMALL + text).settings_lines()[:4] == ["$33=1000", "$35=5.000", "$36=95.000", "$79=1"]
    assert "$93=1.500" in load(tmp_path, SMALL + text).settings_lines()


def test_the_delays_of_a_spindle(tmp_path: Path) -> None:
    text = "[spindle]\non_delay_s = 3\noff_delay_s = 4.5\nat_speed_pct = 5\n"
    lines = load(tmp_path, SMALL + text).settings_lines()
    assert {"$394=3.000", "$539=4.500", "$340=5"} <= set(lines)


def test_a_rotary_axis_with_a_switch_has_a_cycle(tmp_path: Path) -> None:
    text = FULL.replace("[axis.a]\n", '[axis.a]\ntravel_deg = 180\nhome_at = "max"\n')
    assert load(tmp_path, text).settings()[46] == 8


@pytest.mark.parametrize(
    ("key", "line"),
    [
        ("invert_direction = true", "$3=1"),
        ("invert_direction = false", "$3=0"),
        ("invert_step = true", "$2=1"),
        ("invert_step = false", "$2=0"),
        ('home_at = "min"', "$23=1"),
        ('home_at = "max"', "$23=0"),
    ],
)
def test_an_axis_that_says_it_sets_the_mask(tmp_path: Path, key: str, line: str) -> None:
    assert load(tmp_path, SMALL + key).settings_lines()[0] == line


GANTRY = """
schema = 1
name = "Gantry"
[axis.x]
steps_per_mm = 80
max_rate_mm_min = 6000
acceleration_mm_s2 = 500
[axis.y]
steps_per_mm = 80
max_rate_mm_min = 6000
acceleration_mm_s2 = 500
[axis.y.second]
driver = "a"
"""


def test_a_second_motor_by_the_driver_of_an_axis_that_the_machine_lacks(tmp_path: Path) -> None:
    """What was given up comes before what is taken."""
    plain = load(tmp_path, GANTRY).settings()
    assert (plain[79], plain[210], plain[211]) == (2, 0, 4) and not plain.keys() & {8, 200, 201, 206}
    full = load(tmp_path, GANTRY + "invert_direction = true\npull_off_mm = 1.5\nown_switch = false\n")
    assert {number: full.settings()[number] for number in (8, 201, 206)} == {8: 2, 201: 1.5, 206: 2}
    assert full.settings_lines()[:2] == ["$210=0", "$8=2"]
    own = load(tmp_path, GANTRY.replace('driver = "a"', "own_switch = true")).settings()
    assert own[206] == 0 and not own.keys() & {210, 211}


@pytest.mark.parametrize(
    ("driver", "why"),
    [("y", "is the driver of Y, which is an axis of this machine"), ("x", "must be 'y', 'z'")],
)
def test_a_driver_that_is_not_to_spare(tmp_path: Path, driver: str, why: str) -> None:
    with pytest.raises(MachineError, match=why):
        load(tmp_path, GANTRY.replace('driver = "a"', f'driver = "{driver}"'))


def test_one_driver_for_two_axes(tmp_path: Path) -> None:
    with pytest.raises(MachineError, match="names A, which is the second motor of another axis"):
        load(tmp_path, GANTRY.replace("[axis.y]", '[axis.x.second]\ndriver = "a"\n[axis.y]'))


@pytest.mark.parametrize(
    ("board_id", "second", "why"),
    [
        ("esp32-wroom32", 'driver = "a"', None),
        ("esp32-wroom32", 'driver = "b"\nown_switch = true', "axis B has no limit or home switch"),
        ("esp32-wroom32", 'driver = "b"\nown_switch = false', None),
        ("esp32-wroom32", "pull_off_mm = 2.0", "has no second motor of Y"),
        ("esp32s3-zero", 'driver = "a"', "has no driver of A to spare"),
        ("esp32-wroom32-gantry", 'driver = "z"', "has a second motor of Y already"),
        ("esp32-wroom32-gantry", "pull_off_mm = 2.0", None),
    ],
)
def test_a_gantry_fits_a_board(tmp_path: Path, board_id: str, second: str, why: str | None) -> None:
    machine, board = load(tmp_path, GANTRY.replace('driver = "a"', second)), load_board(board_id)
    if why is None:
        check_fit(board, machine)
        return
    with pytest.raises(UserError, match=why):
        check_fit(board, machine)


@pytest.mark.parametrize(
    ("board_id", "pulse_us", "why"),
    [
        ("mks-tinybee", 32, None),
        ("mks-tinybee", 33, "make step pulses of 32 us at most, not 33"),
        ("esp32s3-devkitc-shift", 33, None),  # its SPI makes any
        ("esp32-wroom32", 33, None),
    ],
)
def test_a_step_pulse_fits_a_board(tmp_path: Path, board_id: str, pulse_us: int, why: str | None) -> None:
    machine, board = load(tmp_path, SMALL + f"[stepper]\nstep_pulse_us = {pulse_us}\n"), load_board(board_id)
    if why is None:
        check_fit(board, machine)
        return
    with pytest.raises(UserError, match=why):
        check_fit(board, machine)


def test_travel_and_axis_count(tmp_path: Path) -> None:
    machine = load(tmp_path, FULL)
    assert machine.travel_mm == (300.0, None, 80.0, None, None, None)
    assert machine.axis_count == 4
    assert load(tmp_path, SMALL).axis_count == 1


def test_a_turning_axis_may_have_an_end(tmp_path: Path) -> None:
    turning = "[axis.c]\nsteps_per_deg = 5\nmax_rate_deg_min = 9\nacceleration_deg_s2 = 7\ntravel_deg = 360\n"
    machine = load(tmp_path, SMALL + turning)
    assert machine.travel_mm == (None, None, None, None, None, 360.0)
    assert "$135=360.000" in machine.settings_lines()


def test_a_profile_cannot_be_changed(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="frozen"):
        load(tmp_path, SMALL).name = "Other"


# --- files and names -----------------------------------------------------------------------------------------------


def test_profiles_that_come_with_us_are_found() -> None:
    machines = find_machines()
    assert {"baseline", "router_3018", "sherline_5400", "rotary_4axis"} <= set(machines)
    assert list(machines) == sorted(machines)


@pytest.mark.parametrize("name", find_machines())
def test_each_is_valid_and_named_once(name: str) -> None:
    machine = load_machine(name)
    assert machine == load_machine(find_machines()[name])
    assert [other for other in find_machines() if load_machine(other).name == machine.name] == [name]


def test_baseline_is_the_measuring_machine() -> None:
    expected = ["$11=0.010", "$12=0.002", "$79=3"]
    for base, value in ((100, "250.000"), (110, "5000.000"), (120, "500.000")):
        expected += [f"${base + index}={value}" for index in range(3)]
    assert load_machine("baseline").settings_lines() == expected


def test_a_file_here_goes_before_a_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "baseline").write_text(SMALL, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    assert load_machine("baseline").name == "Small"


def test_an_unknown_name_gets_a_hint() -> None:
    with pytest.raises(MachineError, match="no machine profile router_3081") as error:
        load_machine("router_3081")
    assert error.value.hint == "did you mean router_3018? Or give the path of a TOML file."
    with pytest.raises(MachineError) as error:
        load_machine("qqqqqq")
    assert error.value.hint is not None and "baseline" in error.value.hint


# --- values as text ------------------------------------------------------------------------------------------------


@given(st.floats(0.001, 1e7))
def test_text_of_a_value_keeps_what_the_controller_keeps(value: float) -> None:
    text = _text(value)
    assert set(text) <= set("0123456789.") and len(text.split(".")[1]) >= 3
    assert float(text) == pytest.approx(value, rel=1e-6)


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (250.0, "250.000"),
        (0.0, "0.000"),
        (314.960629921, "314.96063"),
        (0.0125, "0.0125000"),
        (0.01953125, "0.0195312500"),
        (True, "1"),
        (7, "7"),
    ],
)
def test_text_of_a_value(value: float, text: str) -> None:
    assert _text(value) == text
