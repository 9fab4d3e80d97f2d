"""`wificnc boards import`: configurations of our own, in the words of FluidNC, and what becomes of every line."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner, Result
from wificnc.app import main, root
from wificnc.board.fluidnc.convert import Imported, import_fluidnc
from wificnc.board.fluidnc.remarks import Kind
from wificnc.board.load import load_board
from wificnc.errors import Exit
from wificnc.files.problem import FileProblems
from wificnc.profile import load_machine

HERE = Path(__file__).parent
ROUTER, GANTRY = HERE / "router.yaml", HERE / "gantry.yaml"


def axis(letter: str, step: int, direction: int, more: str = "") -> str:
    motor = f"stepstick:\n        step_pin: gpio.{step}\n        direction_pin: gpio.{direction}\n"
    return f"  {letter}:\n{more}    motor0:\n      {motor}"


AXIS_X = "axes:\n" + axis("x", 25, 26)


def run(*args: str | Path) -> Result:
    return CliRunner().invoke(root, ["boards", "import", *map(str, args)])


def converted(folder: Path, text: str, chip: str | None = None) -> Imported:
    path = folder / "config.yaml"
    path.write_text(text, encoding="utf-8")
    return import_fluidnc(path, chip)


def lost(imported: Imported) -> dict[str, str]:
    return {remark.key: remark.why for remark in imported.remarks.of(Kind.LOST)}


def changed(imported: Imported) -> dict[str, str]:
    return {remark.key: remark.why for remark in imported.remarks.of(Kind.CHANGED)}


def test_a_router_becomes_a_board_that_passes(tmp_path: Path) -> None:
    board_file, machine_file = tmp_path / "b.toml", tmp_path / "m.toml"
    result = run(ROUTER, "-o", board_file, "--machine", machine_file)
    assert result.exit_code == 0, result.output
    board = load_board(board_file)
    assert (board.name, board.chip, board.axes) == ("My Router", "esp32", ("X", "Y", "Z"))
    assert board.pin_names() == {
        "step_x": "GPIO25", "step_y": "GPIO26", "step_z": "GPIO27",
        "dir_x": "GPIO33", "dir_y": "GPIO32", "dir_z": "GPIO22",
        "enable_z": "GPIO14", "limit_y": "GPIO4", "limit_x_min": "GPIO36", "limit_z_max": "GPIO17",
        "enable": "GPIO13", "spindle_enable": "GPIO19", "spindle_pwm": "GPIO23", "coolant_flood": "GPIO18",
        "misc_out_0": "GPIO21", "probe": "GPIO16", "estop": "GPIO34", "misc_in_0": "GPIO35", "misc_in_1": "GPIO39",
    }  # fmt: skip
    assert "--set in_door=0 --set in_start=1" in result.stdout


def test_levels_and_pulls_are_those_of_the_configuration() -> None:
    """FluidNC names what a pin disables, and a pin without `:low` is active high."""
    board = import_fluidnc(ROUTER).board
    assert board["output"]["enable"]["active"] == "low"  # disables high
    assert board["axis"]["z"]["enable"]["active"] == "high"  # disables low
    assert board["axis"]["y"]["step"]["active"] == "low"
    assert board["axis"]["x"]["limit_min"] == {"pin": "GPIO36", "active": "low", "pull": "none"}
    assert board["axis"]["y"]["limit"] == {"pin": "GPIO4", "active": "low", "pull": "up"}
    assert board["axis"]["z"]["limit_max"] == {"pin": "GPIO17", "active": "high", "pull": "down"}


@pytest.mark.parametrize(("level", "settings"), [("low", "$744=1 and $745=1"), ("high", "$744=1")])
def test_a_fault_pin_next_to_an_estop(tmp_path: Path, level: str, settings: str) -> None:
    text = ROUTER.read_text(encoding="utf-8")
    assert text.count("  estop_pin:") == 1
    imported = converted(tmp_path, text.replace("  estop_pin:", f"  fault_pin: gpio.15:{level}\n  estop_pin:"))
    assert changed(imported)["control.fault_pin"].endswith(f"before you send {settings}")
    assert imported.board["input"]["misc"][0]["pin"] == "GPIO15"


def test_times_are_at_least_those_of_the_configuration() -> None:
    timing = import_fluidnc(ROUTER).board["timing"]
    assert (timing["default_pulse_us"], timing["dir_setup_ns"]) == (4, 3000)
    assert timing["max_step_rate_hz"] <= 1e9 / (timing["step_pulse_ns"] + timing["dir_setup_ns"] + 1000)


def test_its_machine_is_a_profile_with_every_number(tmp_path: Path) -> None:
    path = tmp_path / "m.toml"
    path.write_text(import_fluidnc(ROUTER).machine_text("router.yaml"), encoding="utf-8")
    lines = set(load_machine(path).settings_lines())
    assert lines >= {
        "$100=80.500", "$110=5000.000", "$120=300.000", "$130=400.000", "$102=400.000", "$132=80.000",
        "$0=4", "$1=255", "$3=1",  # X alone turns the other way
        "$20=1", "$21=1", "$22=1", "$23=1",  # X alone homes towards its negative end
        "$24=100.000", "$25=1200.000", "$26=250", "$27=2.500", "$44=4", "$45=3", "$46=0",
        "$30=24000.000", "$31=0.000", "$33=5000", "$93=1.500", "$394=2.500", "$539=3.000",
    }  # fmt: skip


def test_a_wait_longer_than_ours_is_said(tmp_path: Path) -> None:
    path = tmp_path / "slow.yaml"
    path.write_text(ROUTER.read_text(encoding="utf-8").replace("spinup_ms: 2500", "spinup_ms: 90000"), encoding="utf-8")
    imported = import_fluidnc(path)
    assert imported.machine["spindle"]["on_delay_s"] == 60
    said = [remark.why for remark in imported.remarks.of(Kind.CHANGED)]
    assert "90 s; the controller waits at most 60 s" in said


def test_nothing_of_the_router_is_lost_and_what_differs_is_said() -> None:
    imported = import_fluidnc(ROUTER)
    assert lost(imported) == {}
    said = [remark.why for remark in imported.remarks.of(Kind.CHANGED)]
    assert any("mpos_mm" in why for why in said) and any(why.startswith("seek_mm_min of the axes") for why in said)


def test_shift_registers_and_two_motors_keep_their_pins(tmp_path: Path) -> None:
    imported = import_fluidnc(GANTRY)
    axis = imported.board["axis"]
    assert imported.board["step"] == {"engine": "i2s"}
    assert {key: wire["pin"] for key, wire in imported.board["i2so"].items() if key != "outputs"} == {
        "bck": "GPIO22", "data": "GPIO21", "ws": "GPIO17",
    }  # fmt: skip
    assert (axis["x"]["step"]["pin"], axis["x"]["enable"]["pin"]) == ("I2SO.2", "I2SO.0")
    assert axis["y"]["second"]["limit_min"]["pin"] == "GPIO39"
    # the second motor turns against the first: the axis as a whole is turned by $3
    assert axis["y"]["second"]["dir"]["active"] == "low" and imported.machine["axis"]["y"]["invert_direction"] is True
    assert imported.board["timing"]["step_pulse_ns"] == imported.board["timing"]["dir_setup_ns"] == 2000


def gantry_with(tmp_path: Path, first: str, second: str) -> Imported:
    text = GANTRY.read_text(encoding="utf-8")
    text = text.replace("limit_neg_pin: gpio.36:low\n", first).replace("limit_neg_pin: gpio.39:low\n", second)
    return converted(tmp_path, text)


@pytest.mark.parametrize(
    ("first", "second"),
    [("limit_neg_pin: gpio.36:low\n", "pulloff_mm: 2.5\n"), ("hard_limits: false\n", "limit_neg_pin: gpio.36:low\n")],
)
def test_two_motors_with_one_switch_are_taken(tmp_path: Path, first: str, second: str) -> None:
    """Wherever it is wired, both stop at it: it is the first motor's here."""
    imported = gantry_with(tmp_path, first, second)
    y = imported.board["axis"]["y"]
    assert y["limit_min"]["pin"] == "GPIO36" and "limit_min" not in y["second"]
    assert "second-switch" not in {found.rule for found in imported.refused}
    assert any("one switch for both motors" in remark.why for remark in imported.remarks.of(Kind.CHANGED))


def test_two_motors_with_a_switch_at_an_end_each_have_one_for_both(tmp_path: Path) -> None:
    """Homing finds one of them only, so it is the axis', and so is the other one at the far end."""
    imported = gantry_with(tmp_path, "limit_neg_pin: gpio.36:low\n", "limit_pos_pin: gpio.39:low\n")
    y = imported.board["axis"]["y"]
    assert (y["limit_min"]["pin"], y["limit_max"]["pin"]) == ("GPIO36", "GPIO39")
    assert not {name for name in y["second"] if name.startswith("limit")} and imported.refused == []
    assert any("one switch for both motors" in remark.why for remark in imported.remarks.of(Kind.CHANGED))


def test_the_pull_off_of_a_second_motor_is_its_own(tmp_path: Path) -> None:
    imported = gantry_with(tmp_path, "limit_neg_pin: gpio.36:low\n", "pulloff_mm: 2.5\n")
    assert imported.machine["axis"]["y"]["second"] == {"pull_off_mm": 2.5}
    profile = tmp_path / "m.toml"
    profile.write_text(imported.machine_text("gantry.yaml"), encoding="utf-8")
    assert load_machine(profile).settings()[201] == 2.5


def test_losses_are_named_with_their_line_and_reason() -> None:
    imported = import_fluidnc(GANTRY)
    reasons = lost(imported)
    assert reasons.keys() == {
        "axes.x.motor0.tmc_2208", "axes.z.motor0.rc_servo", "axes.z", "huanyang", "uart1", "sdcard",
    }  # fmt: skip
    assert "registers" in reasons["axes.x.motor0.tmc_2208"] and "inverter" in reasons["huanyang"]
    lines = GANTRY.read_text(encoding="utf-8").splitlines()
    for remark in imported.remarks.of(Kind.LOST):
        assert lines[remark.line - 1].strip().lower().startswith(remark.key.rpartition(".")[2])


def test_the_files_say_what_was_lost() -> None:
    text = import_fluidnc(GANTRY).board_text("gantry.yaml")
    line = 1 + GANTRY.read_text(encoding="utf-8").splitlines().index("Huanyang:")
    assert f"#   huanyang (line {line}): a frequency inverter on RS-485" in text


@pytest.mark.parametrize(
    ("spindle", "outputs", "machine"),
    [
        (
            "Laser:\n  output_pin: gpio.23\n  enable_pin: gpio.19\n  speed_map: 0=0% 1000=100%\n",
            {"spindle_pwm": "GPIO23", "spindle_enable": "GPIO19"},
            {"laser": True, "max_rpm": 1000, "min_rpm": 0},
        ),
        ("relay:\n  output_pin: gpio.23\n  direction_pin: gpio.19\n",
         {"spindle_enable": "GPIO23", "spindle_dir": "GPIO19"}, {}),
        ("10V:\n  output_pin: gpio.23\n  forward_pin: gpio.19\n  pwm_hz: 1000\n",
         {"spindle_pwm": "GPIO23", "spindle_enable": "GPIO19"}, {"pwm_hz": 1000}),
        ("NoSpindle:\n", {}, {}),
    ],
)  # fmt: skip
def test_spindles(tmp_path: Path, spindle: str, outputs: dict[str, str], machine: dict[str, object]) -> None:
    imported = converted(tmp_path, AXIS_X + spindle)
    assert {key: wire["pin"] for key, wire in imported.board.get("output", {}).items()} == outputs
    assert imported.machine.get("spindle", {}) == machine
    assert lost(imported) == {}


@pytest.mark.parametrize("name", ["YL620", "H2A", "Huanyang", "BESC", "HBridge", "DAC", "PlasmaSpindle"])
def test_spindles_that_are_not_taken(tmp_path: Path, name: str) -> None:
    imported = converted(tmp_path, f"{AXIS_X}{name}:\n  tool_num: 0\n  speed_map: 0=0% 1=100%\n")
    assert lost(imported).keys() == {name.lower()} and "spindle" not in imported.machine


@pytest.mark.parametrize(
    ("speeds", "expected"),
    [
        ("0=0% 24000=100%", {"max_rpm": 24000, "min_rpm": 0}),
        ("0=0% 0=25% 6000=25% 24000=100%", {"max_rpm": 24000, "min_rpm": 6000, "pwm_min_pct": 25}),
        ("0=0% 1000=0% 12000=90%", {"max_rpm": 12000, "min_rpm": 1000, "pwm_max_pct": 90}),
        ("0=8.5% 1000=85%", {"max_rpm": 1000, "min_rpm": 0, "pwm_min_pct": 8.5, "pwm_max_pct": 85}),
    ],
)
def test_speed_maps(tmp_path: Path, speeds: str, expected: dict[str, float]) -> None:
    imported = converted(tmp_path, f"{AXIS_X}PWM:\n  output_pin: gpio.23\n  speed_map: {speeds}\n")
    assert imported.machine["spindle"] == expected


def test_a_curve_keeps_its_ends_and_is_lost_between(tmp_path: Path) -> None:
    imported = converted(tmp_path, f"{AXIS_X}PWM:\n  output_pin: gpio.23\n  speed_map: 0=0% 500=90% 1000=100%\n")
    assert imported.machine["spindle"] == {"max_rpm": 1000, "min_rpm": 0}
    assert "curve" in lost(imported)["pwm.speed_map"]


def test_what_the_rules_refuse_is_left_out_with_their_words(tmp_path: Path) -> None:
    """GPIO5 is pulled up at reset, GPIO34 has no resistor and no driver: the board would not be safe, or not work."""
    text = AXIS_X + "coolant:\n  flood_pin: gpio.5\n  mist_pin: gpio.34\nprobe:\n  pin: gpio.35:low:pu\n"
    imported = converted(tmp_path, text, "esp32")
    assert imported.refused == [] and imported.board["output"] == {}
    assert "boot-level" in lost(imported)["output.coolant_flood"]
    assert "input-only" in lost(imported)["output.coolant_mist"]
    assert imported.board["input"]["probe"]["pull"] == "none" and "10 kOhm" in changed(imported)["input.probe"]


S3_X = "axes:\n" + axis("x", 4, 5)


@pytest.mark.parametrize(
    ("wrong", "chip"),
    [
        ("flood_pin: gpio.35", "esp32"),  # can only be read there
        ("flood_pin: gpio.42", "esp32"),  # it has no such pin
        ("flood_pin: gpio.6", "esp32"),  # its flash's
        ("flood_pin: gpio.2", "esp32"),
    ],
)
def test_a_wrong_pin_does_not_turn_an_esp32_into_an_s3(tmp_path: Path, wrong: str, chip: str) -> None:
    """X is at GPIO25 and 26, which an ESP32-S3 does not have to spare."""
    imported = converted(tmp_path, f"{AXIS_X}coolant:\n  {wrong}\n")
    assert imported.board["chip"] == chip
    assert ("output.coolant_flood" in lost(imported)) == ("gpio.2" not in wrong)


def test_two_pins_of_an_s3_mean_an_s3(tmp_path: Path) -> None:
    text = S3_X + "coolant:\n  flood_pin: gpio.42\n  mist_pin: gpio.41\n"
    assert converted(tmp_path, text).board["chip"] == "esp32s3"
    assert converted(tmp_path, AXIS_X + "probe:\n  pin: gpio.35\n").board["chip"] == "esp32"


def test_a_pin_alone_does_not_say_which_chip_it_is(tmp_path: Path) -> None:
    """It may be a slip, and the other pins are of both chips: the name says it, or --chip."""
    text = S3_X + "coolant:\n  flood_pin: gpio.42\n"
    with pytest.raises(FileProblems, match="GPIO42 cannot be used so on an ESP32") as caught:
        converted(tmp_path, text)
    assert "--chip esp32s3" in str(caught.value)
    assert converted(tmp_path, text, "esp32s3").refused == []
    assert converted(tmp_path, f"board: My S3 board\n{text}").board["chip"] == "esp32s3"


def test_the_pin_of_a_psram_means_a_module_without_one(tmp_path: Path) -> None:
    """GPIO26 of an ESP32-S3; on the classic ESP32 it is any pin."""
    imported = converted(tmp_path, "axes:\n" + axis("x", 4, 26), "esp32s3")
    assert imported.board["memory"] == {"mode": "flash", "flash_mb": [4, 8, 16], "psram_mb": [0]}
    assert "GPIO26" in changed(imported)["memory.mode"] and imported.refused == []
    assert converted(tmp_path, "axes:\n" + axis("x", 4, 5), "esp32s3").board["memory"]["mode"] == "quad"
    assert "memory.mode" not in changed(converted(tmp_path, AXIS_X, "esp32"))


def test_shift_registers_of_an_s3_have_pulses_that_its_spi_can_make(tmp_path: Path) -> None:
    """The outputs decide which chip it is: GPIO47 is the S3's."""
    text = """stepping:
  engine: I2S_STATIC
i2so:
  bck_pin: gpio.12
  data_pin: gpio.11
  ws_pin: gpio.10
axes:
  x:
    motor0:
      stepstick:
        step_pin: I2SO.2
        direction_pin: I2SO.1
coolant:
  flood_pin: gpio.47
"""
    imported = converted(tmp_path, text)
    assert imported.refused == [] and lost(imported) == {}
    assert imported.board["chip"] == "esp32s3" and imported.board["step"] == {"engine": "i2s"}
    timing = imported.board["timing"]
    assert (timing["step_pulse_ns"], timing["max_step_rate_hz"]) == (2_500, 160_000)


def test_rmt_with_too_few_channels_is_given_up(tmp_path: Path) -> None:
    axes = "".join(axis(letter, 2 * n + 4, 2 * n + 5) for n, letter in enumerate("xyzab"))
    imported = converted(tmp_path, f"stepping:\n  engine: RMT\naxes:\n{axes}", "esp32s3")
    assert imported.refused == [] and "step" not in imported.board and "RMT" in changed(imported)["step.engine"]


def test_old_names_of_keys(tmp_path: Path) -> None:
    text = """axes:
  x:
    steps_per_mm: 100
    max_rate: 2000
    acceleration: 50
    max_travel: 120
    homing:
      cycle: 1
      feed_rate: 60
      seek_rate: 700
      mpos: 0
    motor0:
      limit_all: gpio.17:low:pu
      stepstick:
        direction: gpio.14
        step: gpio.27
"""
    imported = converted(tmp_path, text)
    assert lost(imported) == {}
    assert imported.machine["axis"]["x"] == {
        "steps_per_mm": 100, "max_rate_mm_min": 2000, "acceleration_mm_s2": 50, "travel_mm": 120, "home_at": "min",
    }  # fmt: skip
    assert imported.board["axis"]["x"]["limit"]["pin"] == "GPIO17"


def test_an_unknown_key_is_lost_by_its_name(tmp_path: Path) -> None:
    assert lost(converted(tmp_path, AXIS_X + "frobnicate:\n  speed: 3\n")) == {"frobnicate": "is not known here"}


@pytest.mark.parametrize("text", ["eighty", "0", "0.0", "-5", "nan", "inf", "80 mm", "", "# 80", "null", "NO_PIN"])
@pytest.mark.parametrize(
    ("key", "ours", "default"),
    [
        ("steps_per_mm", "steps_per_mm", 80),
        ("max_rate_mm_per_min", "max_rate_mm_min", 1000),
        ("acceleration_mm_per_sec2", "acceleration_mm_s2", 25),
    ],
)
def test_a_number_that_cannot_be_is_named_with_what_is_taken_instead(
    tmp_path: Path, key: str, ours: str, default: int, text: str
) -> None:
    imported = converted(tmp_path, "axes:\n" + axis("x", 25, 26, more=f"    {key}: {text}\n"))
    why = lost(imported)[f"axes.x.{key}"]
    assert text.partition("#")[0] in why and f"{default}, FluidNC's default, is taken" in why
    assert imported.machine["axis"]["x"][ours] == default


def test_the_sample_with_no_steps(tmp_path: Path) -> None:
    text = "axes:\n  x:\n    steps_per_mm: 0\n" + axis("x", 26, 16).partition("\n")[2]
    (tmp_path / "c.yaml").write_text(text, encoding="utf-8")
    result = run(tmp_path / "c.yaml", "-o", tmp_path / "b.toml", "--machine", tmp_path / "m.toml")
    assert "axes.x.steps_per_mm" in result.stdout


@pytest.mark.parametrize(
    ("text", "key", "said"),
    [
        ("uart1:\n  txd_pin: gpio.17\n", "uart1", "[pendant]"),
        ("parking:\n  enable: true\n", "parking", "$42"),
        ("ethernet:\n  cs_pin: gpio.5\n", "ethernet", "W5500 goes into [ethernet]"),
        ("atc_manual:\n  safe_z_mpos_mm: 50\n", "atc_manual", "$341"),
    ],
)
def test_what_is_not_taken_is_not_called_impossible(tmp_path: Path, text: str, key: str, said: str) -> None:
    """There are pendants, driver chips, parking, a W5500 and tool changes here."""
    assert said in lost(converted(tmp_path, AXIS_X + text))[key]


def test_an_enable_of_the_shift_registers_is_named(tmp_path: Path) -> None:
    text = GANTRY.read_text(encoding="utf-8").replace("i2so:\n", "i2so:\n  oe_pin: gpio.4\n")
    assert "wire OE to ground" in lost(converted(tmp_path, text))["i2so.oe_pin"]


def test_soft_limits_of_some_axes_are_lost(tmp_path: Path) -> None:
    text = axis("x", 25, 26, more="    soft_limits: true\n")
    assert "need homing" in lost(converted(tmp_path, f"axes:\n{text}"))["axes.x.soft_limits"]


@pytest.mark.parametrize(
    ("text", "line", "said"),
    [
        ("", 1, "has no keys"),
        ("board: x\n", 1, "axes: is missing"),
        ("axes:\n  x:\n    a: 1\n   b: 2\n", 4, "not YAML"),
        ("axes:\n  x:\n    steps_per_mm: 1\n", 1, "no axis with a motor that we drive"),
        ("axes:\n  x:\n    motor0:\n      solenoid:\n        output_pin: gpio.2\n", 1, "a solenoid as a motor"),
    ],
)
def test_no_configuration_is_refused_and_nothing_is_written(tmp_path: Path, text: str, line: int, said: str) -> None:
    path = tmp_path / "bad.yaml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(FileProblems) as caught:
        import_fluidnc(path)
    assert caught.value.problems[0].line == line and said in str(caught.value)
    result = run(path, "-o", tmp_path / "b.toml", "--machine", tmp_path / "m.toml")
    assert result.exit_code != 0
    assert [file.name for file in tmp_path.iterdir()] == ["bad.yaml"]


def test_bytes_that_are_no_text_are_refused(tmp_path: Path) -> None:
    (tmp_path / "bad.yaml").write_bytes(b"axes:\n  \xff\xfe: 1\n")
    with pytest.raises(FileProblems, match="not UTF-8"):
        import_fluidnc(tmp_path / "bad.yaml")


def test_json(tmp_path: Path) -> None:
    result = run(ROUTER, "-o", tmp_path / "b.toml", "--machine", tmp_path / "m.toml", "--json")
    shown = json.loads(result.stdout)
    assert shown["store"] == {"in_door": 0, "in_start": 1} and shown["problems"] == []
    assert {remark["kind"] for remark in shown["remarks"]} == {"taken differently"}


def test_without_names_a_file_that_is_there_stays(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "router.toml").write_text("mine", encoding="utf-8")
    with pytest.raises(SystemExit) as stopped:
        main(["boards", "import", str(ROUTER)])
    assert stopped.value.code == Exit.USAGE
    assert (tmp_path / "router.toml").read_text(encoding="utf-8") == "mine"
    assert not (tmp_path / "router-machine.toml").exists()
