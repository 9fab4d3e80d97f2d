"""The shapers against their definition: what a sum of free vibrations is, and the figures of the literature."""

from __future__ import annotations

import math

import numpy as np
import pytest
from wificnc.tables import load_settings
from wificnc.tune.choice import GOOD, Mode, assignments, recommended, rows, settings_line
from wificnc.tune.shapers import EI, MZV, OFF, SHAPERS, TWO_HUMP_EI, ZV, Impulses, impulses

DAMPINGS = (0.0, 0.02, 0.1, 0.3)
MODES = [(hz, damping) for hz in (5.0, 41.3, 200.0) for damping in DAMPINGS]


def free_vibration(t_s: np.ndarray, hz: float, damping: float) -> np.ndarray:
    """A mass after one impulse: the solution of y'' + 2 z w y' + w^2 y = 0 with y(0) = 0."""
    omega = 2 * math.pi * hz
    return np.where(t_s < 0, 0.0, np.exp(-damping * omega * t_s) * np.sin(omega * math.sqrt(1 - damping**2) * t_s))


def amplitude_after(shape: Impulses, hz: float, damping: float) -> float:
    """Of the vibration after the last impulse, as seen there, by fitting it to samples of the sum of the impulses."""
    omega, last = 2 * math.pi * hz, shape.times_s[-1]
    t_s = last + np.linspace(0.01, 1.0, 400) / hz
    total = sum(w * free_vibration(t_s - t, hz, damping) for w, t in zip(shape.weights, shape.times_s, strict=True))
    phase = omega * math.sqrt(1 - damping**2) * (t_s - last)
    basis = np.stack([np.sin(phase), np.cos(phase)], axis=1) * np.exp(-damping * omega * (t_s - last))[:, None]
    return float(np.hypot(*np.linalg.lstsq(basis, total, rcond=None)[0]))


@pytest.mark.parametrize("shaper", SHAPERS, ids=lambda shaper: shaper.name)
@pytest.mark.parametrize(("hz", "damping"), MODES)
def test_the_residual_is_that_of_the_summed_vibrations(shaper, hz, damping):
    shape = impulses(shaper, hz, damping)
    for factor in (0.6, 0.9, 1.0, 1.07, 1.5):
        assert shape.residual(hz * factor, damping) == pytest.approx(
            amplitude_after(shape, hz * factor, damping), abs=1e-9
        )


@pytest.mark.parametrize("shaper", SHAPERS, ids=lambda shaper: shaper.name)
@pytest.mark.parametrize(("hz", "damping"), MODES)
def test_a_shaper_is_an_average(shaper, hz, damping):
    """Positive weights with the sum 1: no speed and no acceleration becomes larger."""
    shape = impulses(shaper, hz, damping)
    assert sum(shape.weights) == pytest.approx(1.0, abs=1e-12) and min(shape.weights) > 0
    assert shape.times_s[0] == 0.0 and list(shape.times_s) == sorted(set(shape.times_s))


@pytest.mark.parametrize("shaper", [ZV, MZV, TWO_HUMP_EI], ids=lambda shaper: shaper.name)
@pytest.mark.parametrize(("hz", "damping"), MODES)
def test_at_its_frequency_nothing_is_left(shaper, hz, damping):
    """What decays between two impulses is taken out of their weights."""
    assert impulses(shaper, hz, damping).residual(hz, damping) < 1e-12


@pytest.mark.parametrize(("hz", "damping"), MODES)
def test_at_its_frequency_ei_leaves_what_it_tolerates(hz, damping):
    """5 % of one impulse, which has decayed for a period, over the sum of the weights."""
    k = math.exp(-damping * math.pi / math.sqrt(1 - damping**2))
    expected = 0.05 * k**2 / (0.2625 * (1 + k**2) + 0.475 * k)
    assert impulses(EI, hz, damping).residual(hz, damping) == pytest.approx(expected, rel=1e-9)


def insensitivity(shape: Impulses, left: float) -> float:
    """Width of the frequencies around 1 at which no more than `left` is left."""
    ratios = np.linspace(0.3, 1.7, 14001)
    good = np.array([shape.residual(float(ratio), 0.0) for ratio in ratios]) <= left + 1e-9
    middle = len(ratios) // 2
    low = middle - int(np.argmax(~good[middle::-1])) + 1
    high = middle + int(np.argmax(~good[middle:])) - 1
    return float(ratios[high] - ratios[low])


@pytest.mark.parametrize(("shaper", "width"), [(ZV, 0.065), (EI, 0.398), (TWO_HUMP_EI, 0.726)])
def test_widths_at_5_percent_are_those_of_the_literature(shaper, width):
    """Singhose, Seering and Singer, "Input shaping for vibration reduction with specified insensitivity" (1996)."""
    assert insensitivity(impulses(shaper, 1.0, 0.0), 0.05) == pytest.approx(width, abs=0.003)


def test_the_impulses_of_ei_are_those_of_singhose():
    """0.2625, 0.4750, 0.2625 at 0, T/2, T without damping, which leave 5 %."""
    shape = impulses(EI, 40.0, 0.0)
    assert shape.weights == pytest.approx((0.2625, 0.475, 0.2625)) and shape.times_s == pytest.approx(
        (0, 0.0125, 0.025)
    )
    assert shape.residual(40.0, 0.0) == pytest.approx(0.05)


def test_times_are_in_damped_periods():
    """80 % of the frequency is left at a damping of 0.6."""
    assert impulses(ZV, 50.0, 0.6).times_s[1] == pytest.approx(0.5 / 40.0)


@pytest.mark.parametrize("damping", [0.0, 0.05])
def test_zv_rounds_as_two_halves_of_a_period(damping):
    """a T^2 / 8, T half a period: 9.77 um at 40 Hz and 500 mm/s2; delay: half of T."""
    shape = impulses(ZV, 40.0, 0.0)
    assert shape.rounding_mm(500.0) == pytest.approx(500.0 * 0.0125**2 / 8)
    assert shape.delay_s == pytest.approx(0.00625) and impulses(OFF, 40.0, damping).rounding_mm(500.0) == 0.0


@pytest.mark.parametrize(("shaper", "percent"), [(ZV, 7), (MZV, 10), (EI, 25), (TWO_HUMP_EI, 35)])
def test_the_words_say_for_which_errors_a_shaper_is_good(shaper, percent):
    shape = impulses(shaper, 40.0, 0.02)
    for part in np.linspace(-percent, percent, 41):
        assert shape.residual(40.0 * (1 + part / 100), 0.02) <= GOOD
    assert shaper is ZV or f"within {percent} %" in shaper.words


@pytest.mark.parametrize(("spread", "shaper"), [(0.0, ZV), (0.05, ZV), (0.1, MZV), (0.2, EI), (0.3, TWO_HUMP_EI)])
def test_the_shortest_that_is_good_is_recommended(spread, shaper):
    assert recommended(rows(Mode(40.0, 0.02), spread)) is shaper


def test_settings_are_found_by_name():
    table = load_settings()
    numbers = [table[name].number + 1 for name in ("shaper", "shaper_hz", "shaper_damping")]
    values = assignments("y", MZV, Mode(41.304, 0.0204))
    assert values == dict(zip(numbers, ("2", "41.30", "0.020"), strict=True))
    assert settings_line(values) == f"${numbers[0]}=2 ${numbers[1]}=41.30 ${numbers[2]}=0.020"
    assert [shaper.value for shaper in SHAPERS] == list(range(int(table["shaper"].max) + 1))
