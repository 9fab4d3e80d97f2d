"""Whatever is programmed ends: motion comes to rest on its target within the time that it may take."""

from __future__ import annotations

import math
import random
from dataclasses import dataclass

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from motion_host import Host

# In addition to the time at its feed and the time that its axes need from rest to rest.
MARGIN_S = 0.5
RATE_MM_MIN = 8000.0


@dataclass(frozen=True)
class Case:
    """Two moves with a tolerance that lets a blend take all of the second one, so that it ends at rest."""

    tolerance_mm: float
    first: tuple[float, float, float]
    second: tuple[float, float, float]  # where it ends
    rapid: bool
    feed_mm_min: float
    steps_per_mm: tuple[int, int, int]
    accel_mm_s2: int

    def program(self) -> str:
        def words(point: tuple[float, float, float]) -> str:
            return "".join(f"{a}{v:.3f}" for a, v in zip("XYZ", point, strict=True))

        code = "G0" if self.rapid else f"G1F{self.feed_mm_min}"
        return f"G64P{self.tolerance_mm:.3f}\n{code}{words(self.first)}\nG1F{self.feed_mm_min}{words(self.second)}\n"

    def host(self) -> Host:
        host = Host(axes=3)
        rows = ((100, self.steps_per_mm), (110, (RATE_MM_MIN,) * 3), (120, (self.accel_mm_s2,) * 3))
        host.settings(**{f"s{base + ax}": value for base, values in rows for ax, value in enumerate(values)}, s11=0.01)
        return host

    def longest_s(self) -> float:
        """All of it may be one blend, which is passed at the lesser of both feeds, slower where it begins and ends."""
        v = min(self.feed_mm_min, RATE_MM_MIN) / 60
        lengths = (math.dist((0, 0, 0), self.first), math.dist(self.first, self.second))
        return MARGIN_S + sum(1.25 * length / v + 2 * math.sqrt(3 * length / self.accel_mm_s2) for length in lengths)


def random_case(seed: int) -> Case:
    rng = random.Random(seed)
    length, more, turn = 10 ** rng.uniform(-1, 1.5), 10 ** rng.uniform(-1.5, 1), rng.uniform(0, math.tau)
    first = (rng.uniform(-length, length), rng.uniform(-length, length), rng.uniform(-length, length))
    second = (first[0] + more * math.cos(turn), first[1] + more * math.sin(turn), first[2])
    return Case(
        tolerance_mm=10 ** rng.uniform(-2, 1.3),
        first=first,
        second=second,
        rapid=rng.random() < 0.7,
        feed_mm_min=round(10 ** rng.uniform(0.5, 3.9), 2),
        steps_per_mm=rng.choice([(400, 80, 80), (80, 80, 400), (250, 250, 250), (1000, 10, 333)]),
        accel_mm_s2=rng.choice([50, 500, 2000, 8000]),
    )


def reported(tolerance_mm: float, chord_mm: float, feed_mm_min: float) -> Case:
    """As it was found: FS 0, Run, for ever."""
    return Case(tolerance_mm, (1.89, 17, -13), (1.89 - chord_mm, 17, -13), True, feed_mm_min, (400, 80, 80), 2000)


SWEPT = [reported(p, c, f) for p in (0.1, 0.4, 0.623, 1.3, 4) for c in (0.3, 1.18, 2.5) for f in (7.34, 60, 800)]


def assert_ends(host: Host, case: Case, seconds: float) -> None:
    host.wait(seconds)
    assert "<Idle|" in status(host), case
    target = [round(v * n) for v, n in zip(case.second, case.steps_per_mm, strict=True)]
    run = host.settle()
    assert all(abs(is_ - wanted) <= 1 for is_, wanted in zip(run.position, target, strict=False)), case
    assert run.counters.plan_unmet == 0


def status(host: Host) -> str:
    """The answer to ?, while time advances as it does: nothing waits for rest here."""
    host._hear()
    before = len(host._said)
    host.put("?")
    host.wait(0.002)
    host._hear()
    return host._said[before:].decode("latin-1")


@pytest.mark.parametrize(
    "case", SWEPT, ids=lambda c: f"P{c.tolerance_mm}, {c.first[0] - c.second[0]:.2f}, F{c.feed_mm_min}"
)
def test_a_blend_that_ends_at_rest_ends(case: Case) -> None:
    host = case.host()
    host.start(case.program())
    assert_ends(host, case, case.longest_s())
    host.close()


@pytest.mark.parametrize("block", range(10))
def test_random_blends_that_end_at_rest_end(block: int) -> None:
    for seed in range(40 * block, 40 * block + 40):
        case = random_case(seed)
        host = case.host()
        host.start(case.program())
        assert_ends(host, case, case.longest_s())
        host.close()


@settings(max_examples=150, suppress_health_check=list(HealthCheck))
@given(
    seed=st.integers(0, 10_000),
    held_ms=st.lists(st.tuples(st.floats(0.5, 300), st.floats(0.5, 300)), min_size=1, max_size=6),
    overrides=st.lists(st.sampled_from(["\x91" * 10, "\x90", "\x92" * 10, "\x97", "\x95"]), max_size=3),
)
def test_what_was_held_anywhere_ends(seed: int, held_ms: list[tuple[float, float]], overrides: list[str]) -> None:
    """A hold may leave any speed at any place of a blend, and resuming must not crawl from there."""
    case = random_case(seed)
    host = case.host()
    host.start(case.program())
    for run_ms, rest_ms in held_ms:
        host.wait(run_ms / 1000)
        host.put("!" + "".join(overrides))
        host.wait(rest_ms / 1000)
        host.put("~\x90\x95")
    assert_ends(host, case, case.longest_s() + MARGIN_S * len(held_ms))
    host.close()
