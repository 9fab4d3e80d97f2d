"""Frequency and damping from a log. Needs numpy.

The averaged power spectrum shows the peak. Around it, the spectrum of the whole log is fitted with that of a resonance,

    P(x) = (a + b x^4) / ((1 - x^2)^2 + 4 z^2 x^2) + c        x = f / f0

where a is what a knock on the mass adds, b what the motion of its axis adds, and c is noise. The fit is Whittle's
(maximum likelihood: the power of each frequency has an exponential distribution), so it takes a single free decay,
many taps, a sweep and random excitation alike, and needs no averaging, which would widen the peak. For f0 and z the
best of a grid is refined; for each of them a, b and c follow from multiplicative updates, which keep them positive.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from wificnc.errors import JobError, UserError
from wificnc.tables import load_settings
from wificnc.tune.accelerometer import Log
from wificnc.tune.choice import Mode, check_mode
from wificnc.tune.motion import Floats

RESOLUTION_HZ = 0.5  # of the spectrum, where the log is long enough
SEGMENTS_MIN = 4  # averaged, where it is long enough for both
CLEAR = 6.0  # times the median of the band: less is noise, not a peak
OTHER_PEAK = 0.25  # of the power of the highest one
NYQUIST_SHARE = 0.8  # above, the filter of a sensor distorts
BAND = 0.5  # of the peak's frequency to each side
TAPER = 0.05  # of the log at both ends, so that its begin and end are not a knock
BINS_MAX = 4000  # of the fit
UPDATES = 40
ROUNDS = 14  # of the grid, each with SHRINK of the width of the one before
SHRINK = 0.6
DAMPING_GRID = (0.003, 0.7)
GRID = 7


@dataclass(frozen=True)
class Spectrum:
    """Power by frequency, in any unit."""

    hz: Floats
    power: Floats


@dataclass(frozen=True)
class Found:
    """What a log shows."""

    mode: Mode
    peak_hz: float  # of the spectrum
    damped_hz: float  # of the vibration
    other_peaks_hz: tuple[float, ...]
    spectrum: Spectrum
    band_hz: tuple[float, float]


def search_band(log: Log, low_hz: float | None, high_hz: float | None) -> tuple[float, float]:
    """From and to which frequency a log can be searched: as asked for, or all that a shaper takes and the log shows.

    Raises:
        UserError: no shaper takes them, or the log is sampled too slowly.
    """
    limits = load_settings()["shaper_hz"]
    seen = NYQUIST_SHARE * log.rate_hz / 2.0
    low = float(limits.min) if low_hz is None else low_hz
    high = max(low + 1.0, min(float(limits.max), seen)) if high_hz is None else high_hz
    if not limits.min <= low < high <= limits.max:
        raise UserError(f"search from {low:g} to {high:g} Hz: must be within {limits.min:g} to {limits.max:g} Hz")
    if high > log.rate_hz / 2.0:
        hint = f"log faster than {2.0 * high:g} samples/s"
        raise UserError(
            f"{log.rate_hz:.4g} samples/s show vibrations below {log.rate_hz / 2.0:.4g} Hz only, not {high:g} Hz",
            hint=hint if seen <= low else f"{hint}, or search --to-hz {seen:.0f}",
        )
    return low, high


def analyse(log: Log, low_hz: float, high_hz: float) -> Found:
    """The strongest vibration between two frequencies.

    Raises:
        UserError: the vibration fits no setting.
        JobError: there is no vibration.
    """
    spectrum = welch(log)
    peaks = _peaks(spectrum, low_hz, high_hz)
    if not peaks:
        raise JobError(
            f"no clear vibration between {low_hz:g} and {high_hz:g} Hz",
            hint="tap the machine, or log a job with hard corners; fix the sensor to the tool",
        )
    hz, damping = fit(log, peaks[0])
    return Found(
        check_mode(hz, damping),
        peaks[0],
        hz * math.sqrt(1.0 - damping**2),
        tuple(sorted(peaks[1:])),
        spectrum,
        (low_hz, high_hz),
    )


def welch(log: Log) -> Spectrum:
    """Averaged spectra of segments that overlap by half, each with a Hann window."""
    length = min(len(log.values), int(log.rate_hz / RESOLUTION_HZ), max(256, 2 * len(log.values) // (SEGMENTS_MIN + 1)))
    window = np.hanning(length)
    power: Floats = np.zeros(length // 2 + 1)
    starts = range(0, len(log.values) - length + 1, max(1, length // 2))
    for start in starts:
        segment = log.values[start : start + length]
        power += np.abs(np.fft.rfft((segment - segment.mean()) * window)) ** 2
    hz = np.fft.rfftfreq(length, 1.0 / log.rate_hz).astype(np.float64)
    return Spectrum(hz, power / len(starts))


def _peaks(spectrum: Spectrum, low_hz: float, high_hz: float) -> list[float]:
    """The highest one first, then others that matter."""
    hz, power = spectrum.hz, spectrum.power
    inside = (hz >= low_hz) & (hz <= high_hz)
    inside[[0, -1]] = False
    index = np.flatnonzero(inside)
    if not index.size:
        return []
    tops = index[(power[index] >= power[index - 1]) & (power[index] > power[index + 1])]
    tops = tops[np.argsort(-power[tops])]
    if not tops.size or power[tops[0]] < CLEAR * float(np.median(power[index])):
        return []
    kept: list[float] = []
    for top in tops[power[tops] >= OTHER_PEAK * power[tops[0]]]:
        if all(abs(hz[top] - other) > BAND * other for other in kept):
            kept.append(float(hz[top]))
    return kept


def fit(log: Log, peak_hz: float) -> tuple[float, float]:
    """(frequency without damping, damping ratio) of the resonance at a peak."""
    hz, power = _periodogram(log, peak_hz)
    best = (math.log(peak_hz), 0.5 * sum(math.log(z) for z in DAMPING_GRID))
    width = (math.log(1.0 + BAND / 2.0), 0.5 * math.log(DAMPING_GRID[1] / DAMPING_GRID[0]))
    offsets = np.linspace(-1.0, 1.0, GRID)
    for _ in range(ROUNDS):
        grid = [(best[0] + dx * width[0], best[1] + dz * width[1]) for dx in offsets for dz in offsets]
        best = min(grid, key=lambda point: _misfit(hz / math.exp(point[0]), math.exp(point[1]), power))
        width = (width[0] * SHRINK, width[1] * SHRINK)
    return math.exp(best[0]), math.exp(best[1])


def _periodogram(log: Log, peak_hz: float) -> tuple[Floats, Floats]:
    """Of the band around a peak; of a long log the power of neighbours is averaged."""
    count = len(log.values)
    edge = max(1, int(TAPER * count))
    ramp = 0.5 - 0.5 * np.cos(np.pi * np.arange(edge) / edge)
    values = log.values - log.values.mean()
    values[:edge] *= ramp
    values[-edge:] *= ramp[::-1]
    hz = np.fft.rfftfreq(count, 1.0 / log.rate_hz)
    inside = np.abs(hz - peak_hz) < BAND * peak_hz
    power = np.abs(np.fft.rfft(values)[inside]) ** 2
    together = max(1, len(power) // BINS_MAX)
    whole = len(power) // together * together
    means = (array[:whole].reshape(-1, together).mean(axis=1) for array in (hz[inside], power / power.mean()))
    return next(means), next(means)


def _misfit(x: Floats, damping: float, power: Floats) -> float:
    """The negative log-likelihood of the best a, b and c."""
    resonance = 1.0 / ((1.0 - x**2) ** 2 + (2.0 * damping * x) ** 2)
    basis = np.stack([resonance, x**4 * resonance, np.ones_like(x)])
    scale = basis.mean(axis=1)
    parts = np.full(3, 1.0 / 3.0)
    basis /= scale[:, None]
    for _ in range(UPDATES):
        model = parts @ basis
        parts *= np.sqrt((basis @ (power / model**2)) / (basis @ (1.0 / model)))
    model = parts @ basis
    return float(np.sum(np.log(model) + power / model))
