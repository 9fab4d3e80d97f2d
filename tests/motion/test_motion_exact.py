"""Position is sacred: the counter equals the pulses, and every program ends on its exact target."""

from __future__ import annotations

from decimal import ROUND_HALF_UP, Decimal

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from motion_host import BASELINE, Host

LETTERS = "XYZABC"

coordinate = st.decimals(min_value=-40, max_value=40, places=4, allow_nan=False, allow_infinity=False)
tiny = st.decimals(min_value=Decimal("-0.02"), max_value=Decimal("0.02"), places=4)
move = st.tuples(
    st.sampled_from(["G0", "G1"]),
    st.dictionaries(st.sampled_from(LETTERS), st.one_of(coordinate, tiny), min_size=1),
    st.integers(min_value=120, max_value=9000),
)


def expected_steps(target: dict[str, Decimal], steps_per_mm: int) -> list[tuple[int, int]]:
    """Nearest step of each axis; two answers where the target lies within float noise of half way."""
    allowed = []
    for letter in LETTERS:
        exact = target.get(letter, Decimal(0)) * steps_per_mm
        low = int((exact - Decimal("1e-6")).quantize(Decimal(1), ROUND_HALF_UP))
        high = int((exact + Decimal("1e-6")).quantize(Decimal(1), ROUND_HALF_UP))
        allowed.append((min(low, high), max(low, high)))
    return allowed


@settings(max_examples=120, suppress_health_check=[HealthCheck.too_slow])
@given(moves=st.lists(move, min_size=1, max_size=25), incremental=st.booleans())
def test_random_programs_end_on_their_exact_target(
    moves: list[tuple[str, dict[str, Decimal], int]], incremental: bool
) -> None:
    host = Host()
    host.settings(**BASELINE)
    target: dict[str, Decimal] = {}
    lines = ["G91" if incremental else "G90"]
    for code, words, feed in moves:
        lines.append(f"{code}F{feed}" + "".join(f"{letter}{value:f}" for letter, value in words.items()))
        for letter, value in words.items():
            target[letter] = target.get(letter, Decimal(0)) + value if incremental else value
    run = host.run("\n".join(lines))  # no newline at the end: the last line is still in the reader
    run_end = host.run("\n")
    host.close()
    answers = run.answers + run_end.answers
    assert answers == ["ok"] * len(lines)
    for steps, (low, high) in zip(run_end.position, expected_steps(target, 250), strict=True):
        assert low <= steps <= high


@settings(max_examples=60, suppress_health_check=[HealthCheck.too_slow])
@given(moves=st.lists(move, min_size=1, max_size=20))
def test_the_counter_is_the_sum_of_the_pulses(moves: list[tuple[str, dict[str, Decimal], int]]) -> None:
    host = Host()
    host.settings(**BASELINE)
    lines = [f"{code}F{feed}" + "".join(f"{k}{v:f}" for k, v in words.items()) for code, words, feed in moves]
    run = host.run("\n".join(lines) + "\n")
    host.close()
    assert run.position == run.counted()


def test_a_million_tiny_increments_do_not_drift(host: Host) -> None:
    # 0.0011 mm is 0.275 step: rounding each move by itself would end anywhere
    run = host.run("G91G1F5000\n" + "X0.0011Y-0.0007\n" * 20000)
    assert run.position[:2] == [round(0.0011 * 20000 * 250), round(-0.0007 * 20000 * 250)]


@pytest.mark.parametrize("angle", [0, 7, 45, 61, 90, 123, 180, 251, 333])
def test_a_line_stays_within_one_step_of_itself(host: Host, angle: int) -> None:
    x, y = (60 * np.cos(np.radians(angle)), 60 * np.sin(np.radians(angle)))
    run = host.run(f"G1X{x:.4f}Y{y:.4f}F3000\n")
    path = run.positions()[:, :2].astype(float)
    end = path[-1]
    away = np.abs(path[:, 0] * end[1] - path[:, 1] * end[0]) / np.hypot(*end)
    # half a step of each axis, seen across the line, and half a step of waiting for an event of the dominant axis
    assert away.max() <= 0.5 * (abs(x) + abs(y)) / 60 + 0.5


def test_moves_beyond_the_counters_are_refused_and_move_nothing(host: Host) -> None:
    run = host.run("G1F1000X1\nG1X1000000000\nG1X-99999999999999999999\nG1X2\n")
    assert run.answers[0] == "ok" and run.answers[3] == "ok"
    assert all(answer.startswith("error:") for answer in run.answers[1:3])
    assert run.position[0] == 500


@pytest.mark.parametrize("way", ["X-0.002Y0.002Z-0.006", "X-0.010Y3.002\nX-0.002Y0.002Z-0.006"])
def test_half_a_step_is_rounded_away_from_zero(host: Host, way: str) -> None:
    """As lround() does in Grbl: a position and its mirror image are the same number of steps."""
    assert host.run(f"G1F1000{way}\n").position[:3] == [-1, 1, -2]
