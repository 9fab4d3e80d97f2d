"""Joint positions over time as timed segments. Pure: no HAL, no network, no clock."""

from __future__ import annotations

import math
from collections.abc import Sequence

from wificnc.wmc3.layout import Segment

AXES = 6
CLOCK_PULL = 0.01  # a slice's duration is changed by this part when the queue is empty or twice as long as wanted
CATCH_UP_MOST = 0.2  # ... and by at most this one when it is much too long, because this program was held up
SHORTEST_S, LONGEST_S = 0.001, 0.5  # of a slice


class CommandError(ValueError):
    """A commanded position that is no position."""


class Slicer:
    """Every tick the commanded positions become a segment of as many steps as lie between, and as long as the tick was.

    Steps are counted from absolute positions, so no fraction is lost. The device has another clock than we: durations
    are pulled by some 1 % towards the wanted level of its queue, so that it neither runs dry nor fills up. A servo
    thread that was held up and now catches up is no way to go faster than the axes can: such a slice takes longer.
    """

    def __init__(self, scales: Sequence[float], level_s: float, rates: Sequence[float] = ()) -> None:
        """scales: steps per unit of each joint, not 0. level_s: motion that shall wait in the device's queue.
        rates: top speeds, steps/s; none: the device sees to them."""
        if len(scales) > AXES or any(not math.isfinite(scale) or scale == 0.0 for scale in scales):
            raise ValueError(f"{len(scales)} joints with scales {list(scales)}: at most six, none of them 0")
        self.scales = list(scales)
        self.level_s = level_s
        self.rates = list(rates)
        self.steps = [0] * AXES  # where the segments made so far lead

    def begin(self, steps: Sequence[int]) -> Segment:
        """Start where the device stands. The segment fills the queue up to its level with standing still."""
        self.steps = list(steps)
        return Segment(duration_us=round(1e6 * self.level_s))

    def check(self, positions: Sequence[float], seconds: float) -> None:
        """Raises CommandError when a joint is further away than it goes in this time at top speed."""
        for joint, (position, scale, rate) in enumerate(zip(positions, self.scales, self.rates, strict=False)):
            if abs(self._steps_of(position, scale) - self.steps[joint]) > rate * seconds + 1:
                at = self.position(joint, self.steps[joint])
                raise CommandError(f"joint {joint} is commanded to {position:g} and stands at {at:g}: enable it anew")

    def slice(self, positions: Sequence[float], seconds: float, queued_s: float) -> Segment:
        """The way to these positions in the time since the last call.

        Raises CommandError when a position is not finite, or too far away to be counted.
        """
        wanted = [self._steps_of(position, scale) for position, scale in zip(positions, self.scales, strict=True)]
        wanted += self.steps[len(wanted) :]
        way = tuple(new - old for new, old in zip(wanted, self.steps, strict=True))
        self.steps = wanted
        seconds = min(max(seconds, SHORTEST_S), LONGEST_S)
        least = max((abs(count) / rate for count, rate in zip(way, self.rates, strict=False)), default=0.0)
        return Segment(steps=way, duration_us=math.ceil(1e6 * max(seconds * (1.0 + self._pull(queued_s)), least)))

    def _pull(self, queued_s: float) -> float:
        missing = (self.level_s - queued_s) / self.level_s
        if missing >= -1.0:
            return CLOCK_PULL * missing
        return -min(CLOCK_PULL * missing * missing, CATCH_UP_MOST)

    def position(self, joint: int, steps: int) -> float:
        """In units of the joint."""
        return steps / self.scales[joint]

    @staticmethod
    def _steps_of(position: float, scale: float) -> int:
        if not math.isfinite(position) or abs(position * scale) >= 2**31:
            raise CommandError(f"a joint is commanded to {position}")
        return round(position * scale)
