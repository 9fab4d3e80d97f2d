"""Configurations that no FluidNC would start with: a clear refusal or a remark, and never a crash."""

from __future__ import annotations

from pathlib import Path

import pytest
from wificnc.board.fluidnc.convert import import_fluidnc
from wificnc.board.fluidnc.remarks import Kind
from wificnc.board.load import check_board
from wificnc.files.problem import FileProblems
from wificnc.profile import check_machine

AXIS_X = """axes:
  x:
    steps_per_mm: 80
    homing:
      cycle: 1
    motor0:
      limit_all_pin: gpio.34
      stepstick:
        step_pin: gpio.25
        direction_pin: gpio.26
"""
DEEP = "axes:\n" + "".join(f"{'  ' * level}k{level}:\n" for level in range(1, 600))
LARGE = AXIS_X + "".join(f"k{n}: 1\n" for n in range(200_000))


def write(folder: Path, text: str) -> Path:
    path = folder / "config.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def test_ports_that_are_there_twice_are_not_taken_as_one_is_not(tmp_path: Path) -> None:
    """Found in a public configuration."""
    once = import_fluidnc(write(tmp_path, AXIS_X + "uart1:\n  txd_pin: gpio.17\n"))
    twice = import_fluidnc(write(tmp_path, AXIS_X + "uart1:\n  txd_pin: gpio.17\nuart1:\n  txd_pin: gpio.16\n"))
    assert twice.board == once.board
    said = [[remark.why for remark in each.remarks.of(Kind.LOST)] for each in (once, twice)]
    assert said[0] == said[1]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (DEEP, "nested too deeply"),
        (LARGE, "too large"),
        (AXIS_X + AXIS_X, "'axes' is there twice, at lines 1 and 11"),
        (AXIS_X.replace("  x:\n", "  x:\n    steps_per_mm: 1\n  x:\n"), "'x' is there twice, at lines 2 and 4"),
        ("axes: &x\n  x: *x\n", "not YAML"),
    ],
    ids=["deep", "large", "axes-twice", "x-twice", "cyclic"],
)
def test_what_is_no_configuration_is_refused(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(FileProblems) as caught:
        import_fluidnc(write(tmp_path, text))
    assert said in str(caught.value)


@pytest.mark.parametrize("number", ["nan", "inf", "-inf", "1e400"])
@pytest.mark.parametrize(
    ("text", "key"),
    [
        ("stepping:\n  pulse_us: {}\n", "stepping.pulse_us"),
        ("stepping:\n  dir_delay_us: {}\n", "stepping.dir_delay_us"),
        ("stepping:\n  idle_ms: {}\n", "stepping.idle_ms"),
        ("PWM:\n  output_pin: gpio.27\n  pwm_hz: {}\n", "pwm.pwm_hz"),
    ],
)
def test_a_number_without_an_end_is_not_taken(tmp_path: Path, number: str, text: str, key: str) -> None:
    imported = import_fluidnc(write(tmp_path, text.format(number) + AXIS_X))
    lost = {remark.key: remark.why for remark in imported.remarks.of(Kind.LOST)}
    assert f"{number!r} is not understood" in lost[key]


@pytest.mark.parametrize("number", ["nan", "1.5"])
def test_a_homing_cycle_that_is_no_whole_number_is_not_taken(tmp_path: Path, number: str) -> None:
    imported = import_fluidnc(write(tmp_path, AXIS_X.replace("cycle: 1", f"cycle: {number}")))
    assert "axes.x.homing.cycle" in {remark.key for remark in imported.remarks.of(Kind.LOST)}


@pytest.mark.parametrize(
    ("key", "us", "ours", "most"),
    [("pulse_us", "300", "default_pulse_us", 255), ("dir_delay_us", "1e9", "dir_setup_ns", 50_000)],
)
def test_times_that_are_too_long_become_the_longest(tmp_path: Path, key: str, us: str, ours: str, most: int) -> None:
    imported = import_fluidnc(write(tmp_path, f"stepping:\n  {key}: {us}\n{AXIS_X}"))
    assert imported.board["timing"][ours] == most and imported.refused == []
    changed = {remark.key: remark.why for remark in imported.remarks.of(Kind.CHANGED)}
    assert "at most" in changed[f"stepping.{key}"]


def test_digits_of_another_alphabet_are_no_pin(tmp_path: Path) -> None:
    with pytest.raises(FileProblems, match="is not a pin"):
        import_fluidnc(write(tmp_path, AXIS_X.replace("gpio.25", "gpio.２５")))


WHOLE = AXIS_X.replace("cycle: 1", "cycle: 1\n      feed_mm_per_min: 50").replace(
    "steps_per_mm: 80",
    "steps_per_mm: 80\n    max_rate_mm_per_min: 900\n    acceleration_mm_per_sec2: 70\n    max_travel_mm: 300",
) + (
    "stepping:\n  pulse_us: 4\n  dir_delay_us: 1\n  idle_ms: 200\n"
    "junction_deviation_mm: 0.01\narc_tolerance_mm: 0.002\n"
    "coolant:\n  delay_ms: 100\n  flood_pin: gpio.2\nPWM:\n  output_pin: gpio.27\n  pwm_hz: 5000\n  spinup_ms: 100\n"
)


def changed(key: str, value: str, folder: Path) -> Path:
    old = next(line for line in WHOLE.splitlines() if line.strip().startswith(f"{key}:"))
    return write(folder, WHOLE.replace(old, old.partition(":")[0] + f": {value}"))


def said_of(key: str, path: Path) -> list[str]:
    """Of the importer and of the checks of its files."""
    imported = import_fluidnc(path)
    board, machine = path.with_name("board.toml"), path.with_name("machine.toml")
    board.write_text(imported.board_text(path.name), encoding="utf-8")
    machine.write_text(imported.machine_text(path.name), encoding="utf-8")
    remarks = [str(remark) for kind in Kind for remark in imported.remarks.of(kind) if remark.key.endswith(key)]
    return [*remarks, *map(str, check_board(board)), *map(str, check_machine(machine))]


NUMBERS = (
    "steps_per_mm", "max_rate_mm_per_min", "acceleration_mm_per_sec2", "max_travel_mm", "cycle", "feed_mm_per_min",
    "pulse_us", "dir_delay_us", "idle_ms", "junction_deviation_mm", "arc_tolerance_mm", "delay_ms", "pwm_hz",
    "spinup_ms",
)  # fmt: skip


@pytest.mark.parametrize("value", ["", "NO_PIN", "-5", "abc", "1e9"])
@pytest.mark.parametrize("key", NUMBERS)
def test_a_wrong_number_is_never_replaced_in_silence(key: str, value: str, tmp_path: Path) -> None:
    assert said_of(key, changed(key, value, tmp_path))
    assert not said_of(key, write(tmp_path, WHOLE))


@pytest.mark.parametrize("value", ["0", "1e-9"])
@pytest.mark.parametrize(
    "key", ["steps_per_mm", "max_rate_mm_per_min", "acceleration_mm_per_sec2", "max_travel_mm", "pulse_us"]
)
def test_a_number_that_must_be_above_zero(key: str, value: str, tmp_path: Path) -> None:
    assert said_of(key, changed(key, value, tmp_path))


def test_a_travel_of_zero_gets_fluidncs_default(tmp_path: Path) -> None:
    imported = import_fluidnc(changed("max_travel_mm", "0", tmp_path))
    assert imported.machine["axis"]["x"]["travel_mm"] == 1000
    (remark,) = [each for each in imported.remarks.of(Kind.LOST) if each.key == "axes.x.max_travel_mm"]
    assert "0 is not a value for it" in remark.why and "1000, FluidNC's default" in remark.why


def test_a_rotary_axis_may_be_endless(tmp_path: Path) -> None:
    text = AXIS_X.replace("steps_per_mm: 80", "steps_per_mm: 80\n    max_travel_mm: 300")
    rotary = text.replace("axes:\n  x:", "  a:").replace("300", "0").replace("gpio.2", "gpio.1").replace("34", "35")
    more = "".join(
        text.replace("axes:\n  x:", f"  {name}:").replace("gpio.2", f"gpio.{n}") for n, name in ((1, "y"), (3, "z"))
    )
    imported = import_fluidnc(write(tmp_path, text + more + rotary))
    assert imported.machine["axis"]["a"]["travel_deg"] == 0
    assert not [each for each in imported.remarks.of(Kind.LOST) if "max_travel" in each.key]


@pytest.mark.parametrize("key", ["name", "board"])
@pytest.mark.parametrize(
    ("text", "taken"), [("\ufeffMy mill", "My mill"), ("My\u200e mill", "My mill"), ("\u200b", None)]
)
def test_a_name_keeps_what_our_files_may_have(tmp_path: Path, key: str, text: str, taken: str | None) -> None:
    """A copied text may have a byte order mark within it."""
    path = write(tmp_path, f'{key}: "{text}"\n{AXIS_X}').rename(tmp_path / "\u200bconfig.yaml")
    made = import_fluidnc(path)
    assert (made.board["name"], made.name) == (taken or "config", taken or "imported")
    assert said_of(key, path) == [f"{key} (line 1): without the characters that cannot be printed"]
