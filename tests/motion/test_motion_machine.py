"""The machine around the motion: resets keep the position, pauses wait, and every line gets one answer."""

from __future__ import annotations

import pytest
from motion_host import AXES, HOST_BUDGET, Host


@pytest.mark.parametrize("events", [1, 2, 17, 400, 1999, 4321, 9998])
def test_a_reset_in_motion_keeps_the_exact_position(host: Host, events: int) -> None:
    host.start("G1X30Y-20Z3F4000\nX0\n")
    assert host.advance(events) == HOST_BUDGET
    run = host.run("\x18")
    assert "ALARM:3" in run.said
    assert run.position == run.counted()
    assert len(run.events) <= events  # not one pulse more
    after = host.run("G1X10\n$X\nG90G1F3000X10Y10Z10\n")
    assert after.answers == ["error:9", "ok", "ok"]
    assert after.position == [2500, 2500, 2500, 0, 0, 0]


def test_a_reset_at_rest_is_no_alarm(host: Host) -> None:
    host.run("G1X3F1000\n")
    run = host.run("\x18")
    assert "ALARM" not in run.said and "Grbl 1.1h" in run.said
    assert host.run("G1X4F500\n").position == [1000] + [0] * (AXES - 1)


def test_m0_waits_for_cycle_start(host: Host) -> None:
    paused = host.run("G1X1F1000\nM0\nX2\n")
    assert paused.answers == ["ok"] and paused.position[0] == 250
    assert "Hold:0" in host.run("?").said
    resumed = host.run("~")
    assert resumed.answers == ["ok", "ok"] and resumed.position[0] == 500


def test_the_status_report_shows_machine_position(host: Host) -> None:
    host.run("G1X1.5Y-2.248F1000\n")
    assert "<Idle|MPos:1.500,-2.248,0.000,0.000,0.000,0.000|FS:0,0|" in host.run("?").said


@pytest.mark.parametrize("line", ["G1X1X2F10", "G96", "X", "G1Y=3", "#1=", "G2X5", "\x01\x7f&", "G1" + "X" * 100])
def test_a_bad_line_moves_nothing_and_changes_no_mode(host: Host, line: str) -> None:
    run = host.run(f"G91G1F1000X1\n{line}\nX1\n")
    assert [run.answers[0], run.answers[2]] == ["ok", "ok"]
    assert run.answers[1].startswith("error:")
    assert run.position == [500] + [0] * (AXES - 1)


def test_work_offsets_move_the_target_and_not_the_machine(host: Host) -> None:
    run = host.run("G10L2P1X10\nG90G1F2000X5\nG92Y3\nY4\n")
    assert run.answers == ["ok"] * 4
    assert run.position[:2] == [15 * 250, 1 * 250]


def test_an_arc_ends_exactly_and_keeps_its_radius(host: Host) -> None:
    run = host.run("G1F3000X10\nG3X0Y10I-10J0\n")
    path = run.positions()[2500:, :2] / 250
    radius = (path**2).sum(axis=1) ** 0.5
    assert run.position[:2] == [0, 2500]
    # $11 holds for the corner into the arc and for its chords, and a step's rounding on both axes
    assert abs(radius - 10).max() <= 0.01 + 0.004


def test_settings_are_refused_while_moving(host: Host) -> None:
    host.start("G1X30F1000\n$110=100\n")
    host.advance(100)
    run = host.run("")
    assert run.answers == ["ok", "error:8"]


def test_a_step_pulse_below_3_us_is_refused_unless_it_is_the_boards_own() -> None:
    """`$0=2` error:6, as in Grbl; but what a board with a short pulse shows as $0 can be typed back."""
    host = Host(pulse_ns=2000, rate_hz=250_000)
    run = host.run("$0=1\n$0=2\n$0=2.5\n$0=3\n$0=0\n$0=2\n")
    host.close()
    assert run.answers == ["error:6", "ok", "error:6", "ok", "error:6", "ok"]
