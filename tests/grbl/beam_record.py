"""When the beam was on, from the recorded outputs, and when it may have been, from the recorded step edges."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from grbl_host import HZ, Grbl
from numpy.typing import NDArray

Spans = list[tuple[float, float]]  # seconds, sorted, apart

# Motion begins before its first step edge and ends after its last one: half a step at the ramp's slow end, and the
# same between the first edges. 250 steps/mm and 500 mm/s2: sqrt(2 * 0.004 mm / 500 mm/s2).
SLOW_S = 0.004


class BeamRecord:
    """Records from its construction on."""

    def __init__(self, grbl: Grbl, period_us: int = 0) -> None:
        grbl.output_period(period_us)
        grbl.record()
        grbl.record_outputs()
        self.grbl = grbl
        self.period_s = period_us * 1e-6

    def lit(self) -> Spans:
        changes = self.grbl.output_changes()
        on = (changes["duty"] > 0) & (changes["direction"] != 0)
        ends = np.append(changes["t"][1:] / HZ, self.grbl.time())
        return joined((t / HZ, end) for t, end, is_on in zip(changes["t"], ends, on, strict=True) if is_on)

    def motion(self, lines: Iterable[int] | None = None) -> Spans:
        """When step edges of these source lines came; None: of any."""
        events = self.grbl.step_events()
        times = events["t"] / HZ
        if lines is not None:
            times = times[np.isin(events["line"], list(lines))]
        return joined((t - SLOW_S, t + SLOW_S) for t in times)

    def stray_s(self, lines: Iterable[int] | None = None) -> float:
        """Longest time for which it was lit outside the motion of these lines."""
        return longest(without(self.lit(), self.motion(lines)))

    def gap_s(self, lines: Iterable[int]) -> float:
        """Longest time for which these lines moved in the dark."""
        return longest(without(shrunk(self.motion(lines)), self.lit()))

    def positions(self, axis: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Times of the axis' step edges, and where it is after each, in steps."""
        events = self.grbl.step_events()
        mine = events[(events["step"] >> axis & 1) != 0]
        return mine["t"] / HZ, np.cumsum(np.where((mine["dir"] >> axis & 1) != 0, -1.0, 1.0))


def joined(spans: Iterable[tuple[float, float]]) -> Spans:
    out: Spans = []
    for start, end in spans:
        if out and start <= out[-1][1]:
            out[-1] = (out[-1][0], max(end, out[-1][1]))
        else:
            out.append((float(start), float(end)))
    return out


def shrunk(spans: Spans) -> Spans:
    return [(start + 2 * SLOW_S, end - 2 * SLOW_S) for start, end in spans if end - start > 4 * SLOW_S]


def without(spans: Spans, cut: Spans) -> Spans:
    """What is left of `spans` outside of `cut`."""
    out: Spans = []
    for start, end in spans:
        for low, high in cut:
            if high <= start or low >= end:
                continue
            if low > start:
                out.append((start, low))
            start = max(start, high)
        if end > start:
            out.append((start, end))
    return out


def longest(spans: Spans) -> float:
    return max((end - start for start, end in spans), default=0.0)
