"""Broken profiles: each rule broken once, every problem with its file, line, key and reason."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from wificnc.errors import Exit, MachineError
from wificnc.profile import load_machine

# Lines 1 to 6; what a test adds begins on line 7.
HEAD = 'schema = 1\nname = "Small"\n[axis.x]\nsteps_per_mm = 80\nmax_rate_mm_min = 6000\nacceleration_mm_s2 = 500\n'
TRAVEL = "travel_mm = 300\n"


def problems(folder: Path, text: str) -> list[str]:
    """The lines of the message without the folder; hints are joined to their problem."""
    file = folder / "machine.toml"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(MachineError) as error:
        load_machine(file)
    assert error.value.exit_code is Exit.USAGE
    message = error.value.message.replace("\n  hint: ", " | ")
    return [re.sub(r"^.*machine\.toml:", "", line) for line in message.splitlines()]


@pytest.mark.parametrize(
    ("text", "where", "reason"),
    [
        (HEAD + '[homing]\norder = ["X", "Z"]\n', "8: homing.order", "names Z, which this machine does not have"),
        (HEAD + '[homing]\norder = ["X", "X"]\n', "8: homing.order", "names X twice"),
        (HEAD + '[homing]\norder = ["U"]\n', "8: homing.order[0]", "pattern"),
        (HEAD + "[spindle]\npwm_min_pct = 50\npwm_max_pct = 50.5\n", "8: spindle.pwm_min_pct", "at least 1 % below"),
        (
            HEAD + '[kinematics]\ntype = "scara"\narm_1_mm = 60\n',
            "7: kinematics.arm_2_mm",
            "two arms need their lengths",
        ),
        (
            HEAD + '[kinematics]\ntype = "polar"\narm_1_mm = 60\n',
            "9: kinematics.arm_1_mm",
            "for a two-arm machine only",
        ),
        (HEAD + '[kinematics]\ntype = "corexy"\n', "8: kinematics.type", "CoreXY needs both X and Y"),
        (
            HEAD
            + HEAD[HEAD.index("[axis.x]") :].replace("axis.x", "axis.y").replace("80", "81")
            + '[kinematics]\ntype = "corexy"\n',
            "8: axis.y.steps_per_mm",
            "X and Y of a CoreXY need the same steps/mm",
        ),
        # shape
        (HEAD.replace("schema = 1\n", ""), "1: schema", "missing"),
        (HEAD.replace("schema = 1", "schema = 2"), "1: schema", "must be 1, not 2"),
        (HEAD.replace('name = "Small"\n', ""), "1: name", "missing"),
        (HEAD.replace("steps_per_mm = 80\n", ""), "3: axis.x.steps_per_mm", "missing"),
        (HEAD.replace("steps_per_mm", "steps_per_m"), "4: axis.x.steps_per_m", "did you mean steps_per_mm?"),
        (HEAD + "[stepper]\nstep_puls_us = 5\n", "8: stepper.step_puls_us", "did you mean step_pulse_us?"),
        (HEAD + "[homming]\n", "7: homming", "did you mean homing?"),
        (HEAD + "[axis.u]\n", "7: axis.u", "unknown key"),
        (HEAD.replace("= 80", '= "80"'), "4: axis.x.steps_per_mm", "must be a valid number, not '80'"),
        (HEAD.replace("= 80", "= true"), "4: axis.x.steps_per_mm", "must be a valid number"),
        (HEAD.replace("= 80", "= nan"), "4: axis.x.steps_per_mm", "finite"),
        (HEAD.replace("= 80", "= inf"), "4: axis.x.steps_per_mm", "finite"),
        (HEAD.replace("= 80", "= 0"), "4: axis.x.steps_per_mm", "0.001, not 0"),
        (HEAD.replace("= 80", "= -80"), "4: axis.x.steps_per_mm", "0.001, not -80"),
        (HEAD.replace("= 80", "= 20000.1"), "4: axis.x.steps_per_mm", "20000, not 20000.1"),
        (HEAD + "travel_mm = -1\n", "7: axis.x.travel_mm", "not -1"),
        (HEAD + 'home_at = "left"\n', "7: axis.x.home_at", "'min' or 'max'"),
        (HEAD + "[stepper]\nstep_pulse_us = 0\n", "8: stepper.step_pulse_us", "1, not 0"),
        (HEAD + "[stepper]\nstep_pulse_us = 5.5\n", "8: stepper.step_pulse_us", "must be a whole number, not 5.5"),
        (HEAD + "[stepper]\nidle_delay_ms = 65536\n", "8: stepper.idle_delay_ms", "65535, not 65536"),
        (HEAD + "[limits]\nhard = 1\n", "8: limits.hard", "must be true or false, not 1"),
        (HEAD + "[motion]\narc_tolerance_mm = 0\n", "8: motion.arc_tolerance_mm", "0.0001, not 0"),
        # rules between values
        ('schema = 1\nname = "Nothing"\n[axis]\n', "3: axis", "at least one axis"),
        (HEAD + TRAVEL + "[limits]\nsoft = true\n", "9: limits.soft", "need homing"),
        (HEAD + TRAVEL + "[limits]\nsoft = true\n[homing]\nenabled = false\n", "9: limits.soft", "need homing"),
        (HEAD + "[limits]\nsoft = true\n[homing]\nenabled = true\n", "3: axis.x.travel_mm", "need the travel"),
        (
            HEAD.replace("= 80", "= 1000") + "[stepper]\nstep_pulse_us = 10\n",
            "5: axis.x.max_rate_mm_min",
            "this is 100000 steps/s, and pulses of 10 us allow 50000",
        ),
        (HEAD + "[homing]\nfeed_mm_min = 900\nseek_mm_min = 800\n", "8: homing.feed_mm_min", "faster than the search"),
        (HEAD + TRAVEL + "[homing]\npull_off_mm = 300\n", "9: homing.pull_off_mm", "only 300 mm of travel"),
        (
            HEAD + TRAVEL + "[axis.x.second]\npull_off_mm = 300\n",
            "9: axis.x.second.pull_off_mm",
            "only 300 mm of travel",
        ),
        (HEAD + "[spindle]\nmin_rpm = 5000\nmax_rpm = 5000\n", "8: spindle.min_rpm", "below max_rpm (5000)"),
    ],
)
def test_each_rule_alone(tmp_path: Path, text: str, where: str, reason: str) -> None:
    (problem,) = problems(tmp_path, text)
    assert problem.startswith(f"{where}:"), problem
    assert reason in problem


@pytest.mark.parametrize(
    "text",
    [
        HEAD + TRAVEL + "[limits]\nsoft = true\n[homing]\nenabled = true\n",
        HEAD.replace("= 80", "= 500") + "[stepper]\nstep_pulse_us = 10\n",  # exactly 50000 steps/s
        HEAD + "[homing]\nfeed_mm_min = 800\nseek_mm_min = 800\n",
        HEAD + TRAVEL + "[homing]\npull_off_mm = 299\n",
        HEAD + TRAVEL + "[axis.x.second]\npull_off_mm = 299\n",
        HEAD + "[spindle]\nmin_rpm = 4999\nmax_rpm = 5000\n",
        HEAD + "[spindle]\nmin_rpm = 4999\n",
    ],
)
def test_just_inside_each_rule(tmp_path: Path, text: str) -> None:
    file = tmp_path / "machine.toml"
    file.write_text(text, encoding="utf-8")
    load_machine(file)


def test_endless_turning_axis_needs_no_travel_for_soft_limits(tmp_path: Path) -> None:
    turning = "[axis.a]\nsteps_per_deg = 5\nmax_rate_deg_min = 9\nacceleration_deg_s2 = 7\n"
    file = tmp_path / "machine.toml"
    file.write_text(HEAD + TRAVEL + turning + "[limits]\nsoft = true\n[homing]\nenabled = true\n", encoding="utf-8")
    assert "$20=1" in load_machine(file).settings_lines()


def test_all_problems_at_once_in_the_order_of_the_file(tmp_path: Path) -> None:
    text = HEAD.replace("= 80", "= 0").replace("max_rate_mm_min", "max_rate_mm_s") + "[spindle]\nrpm = 3\n[homing]\n"
    found = problems(tmp_path, text + "debounce_ms = -1\n")
    assert [problem.split(":")[0] for problem in found] == ["4", "5", "8", "10"]


def test_rules_too_report_all_at_once(tmp_path: Path) -> None:
    found = problems(tmp_path, HEAD + "[limits]\nsoft = true\n[spindle]\nmin_rpm = 9\nmax_rpm = 8\n")
    assert [re.search(r"\[([a-z-]+)\]", problem)[1] for problem in found] == [  # type: ignore[index]
        "soft-limits",
        "soft-limits",
        "spindle-range",
    ]


def test_degrees_for_an_axis_that_turns(tmp_path: Path) -> None:
    found = problems(tmp_path, HEAD + "[axis.a]\nsteps_per_mm = 5\nmax_rate_deg_min = 9\nacceleration_deg_s2 = 7\n")
    assert found == ["8: axis.a.steps_per_mm: unknown key [unknown-key] | did you mean steps_per_deg?"]


@pytest.mark.parametrize(
    ("content", "reason"),
    [(b"schema = = 1", "not TOML"), (b"\xff\xfe\x00", "UTF-8"), (b"", "missing"), (b"a = 1\na = 2\n", "not TOML")],
)
def test_files_that_are_no_profile(tmp_path: Path, content: bytes, reason: str) -> None:
    file = tmp_path / "machine.toml"
    file.write_bytes(content)
    with pytest.raises(MachineError, match=reason):
        load_machine(file)


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(MachineError, match=r"gone\.toml:1: No such file"):
        load_machine(str(tmp_path / "gone.toml"))
    with pytest.raises(MachineError):
        load_machine(tmp_path)
