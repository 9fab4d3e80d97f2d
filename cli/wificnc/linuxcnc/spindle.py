"""Where the spindle is, between two status reports, as LinuxCNC's encoder pins want it. Pure."""

from __future__ import annotations

import math
from collections import deque

from wificnc.wmc3.layout import Status

ANGLE_ONE = 65536  # of a report: one turn
HALF = 1 << 31  # of the range of its whole turns
SPEED_SPAN = 8  # reports over which the speed is the mean
CLOCK_SPAN = 200  # ... and among which the fastest one says what the clocks differ by
AHEAD_MOST_S = 0.1  # the position goes on for so long without a report
STANDING_RPS = 0.01
JUMP_LEAST, JUMP_PART = 0.03, 0.3  # turns; part of the way by the device's own speed
BACKWARDS = 2  # Status.spindle
AT_SPEED = 0.05  # of the commanded speed


class Encoder:
    """Reports of an angle, each with the device's time, become a position in turns at any time.

    Whole numbers of the position lie at the index, also after index_enable, which sets it to 0 there.
    """

    def __init__(self) -> None:
        self._reports: deque[tuple[float, float]] = deque(maxlen=SPEED_SPAN)  # device's time, s; turns
        self._lags: deque[float] = deque(maxlen=CLOCK_SPAN)
        self._turned = 0.0  # since the first report: after a turn the index is known
        self._turns = self._whole = 0  # of the newest report; since the first one
        self._wraps = 0
        self._us: int | None = None
        self._zero = 0  # whole turns
        self._armed: float | None = None  # where it was when index_enable was last seen

    @property
    def speed_rps(self) -> float:
        """Turns per second, negative when it turns back."""
        if len(self._reports) < 2:
            return 0.0
        (first_s, first), (last_s, last) = self._reports[0], self._reports[-1]
        speed = (last - first) / (last_s - first_s) if last_s > first_s else 0.0
        return speed if abs(speed) > STANDING_RPS else 0.0

    def take(self, device_us: int, now_s: float, status: Status) -> None:
        """A report. device_us: the device's clock, 32 bits. Late ones are left out."""
        if self._us is not None:
            ahead = (device_us - self._us) & 0xFFFFFFFF
            if ahead == 0 or ahead >= HALF:
                return
            self._wraps += device_us < self._us
        self._us = device_us
        device_s = (device_us + (self._wraps << 32)) / 1e6
        if self._reports:
            self._whole += (status.spindle_turns - self._turns + HALF) % (2 * HALF) - HALF
        self._turns = status.spindle_turns
        turns = self._whole + status.spindle_angle / ANGLE_ONE
        self._follow_index(turns, device_s, status)
        self._reports.append((device_s, turns))
        self._lags.append(now_s - device_s)

    def _follow_index(self, turns: float, device_s: float, status: Status) -> None:
        """Before its first index pulse the device counts from anywhere. A jump that is no motion is that pulse."""
        if not self._reports:
            return
        last_s, last = self._reports[-1]
        expected = status.rpm / 60 * (device_s - last_s)
        self._turned += expected
        if abs(abs(turns - last) - expected) <= JUMP_LEAST + JUMP_PART * expected:
            return
        back = self.speed_rps < 0.0 if self.speed_rps else status.spindle == BACKWARDS
        jump = turns - last - (-expected if back else expected)
        self._reports = deque(((at_s, at + jump) for at_s, at in self._reports), SPEED_SPAN)
        if self._armed is not None:
            self._armed += jump

    def turns(self, now_s: float) -> float:
        """Raw position: 0 at the index before the first report."""
        if not self._reports:
            return 0.0
        at_s, turns = self._reports[-1]
        since = now_s - min(self._lags) - at_s
        return turns + self.speed_rps * min(max(since, 0.0), AHEAD_MOST_S)

    def update(self, now_s: float, index_enable: bool) -> tuple[float, bool]:
        """Position and index_enable for the pins, as LinuxCNC's encoders have them: when it is true, the next index
        sets the position to 0 and makes it false."""
        raw = self.turns(now_s)
        if not index_enable:
            self._armed = None
            return raw - self._zero, False
        if self._armed is None:
            self._armed = raw
        passed = math.floor(raw) - math.floor(self._armed)
        if self._turned < 1.0:
            self._armed = raw
        elif passed and self.speed_rps:
            self._zero = math.floor(raw) if passed > 0 else math.floor(raw) + 1
            self._armed = None
            return raw - self._zero, False
        return raw - self._zero, True


class AtSpeed:
    """spindle.N.at-speed: with an encoder, the measured speed is the commanded one; without, so long after it was
    switched."""

    def __init__(self, run_up_s: float) -> None:
        self.run_up_s = run_up_s
        self._wanted: tuple[int, int] = (0, 0)
        self._since_s = -math.inf

    def update(self, now_s: float, wanted: tuple[int, int], status: Status, encoder: Encoder | None) -> bool:
        """wanted: spindle (0 off, 1 CW, 2 CCW) and rpm as they were commanded."""
        if wanted != self._wanted:
            self._wanted, self._since_s = wanted, now_s
        spindle, rpm = wanted
        if spindle == 0:
            return True
        if status.spindle != spindle:
            return False
        if encoder is None:
            return now_s - self._since_s >= self.run_up_s
        return abs(abs(encoder.speed_rps) * 60 - rpm) <= AT_SPEED * rpm and encoder.speed_rps != 0.0
