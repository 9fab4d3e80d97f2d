"""The encoder's pins between two reports: position, speed, and index-enable as LinuxCNC's own encoders have it."""

from __future__ import annotations

import ctypes
import math
import random
from collections.abc import Callable

import pytest
from component_library import AtSpeed, IoControl, Status, library

REPORT_S = 0.05
BOOT_US = 2**32 - 1_500_000  # the device's clock wraps in the middle of it


class Encoder:
    """linuxcnc/encoder.c"""

    def __init__(self) -> None:
        self.handle: int = library().component_encoder()

    def take(self, device_us: int, now_s: float, status: Status) -> None:
        library().encoder_take(self.handle, device_us, now_s, status)

    def update(self, now_s: float, index_enable: bool) -> tuple[float, bool]:
        armed = ctypes.c_bool(index_enable)
        position: float = library().encoder_update(self.handle, now_s, ctypes.byref(armed))
        return position, armed.value

    def turns(self, now_s: float) -> float:
        return self.update(now_s, False)[0]

    @property
    def speed_rps(self) -> float:
        return float(library().encoder_speed_rps(self.handle))


def is_at_speed(at: AtSpeed, now_s: float, wanted: tuple[int, int], status: Status, encoder: Encoder | None) -> bool:
    said = IoControl(0, *wanted, 0)
    return bool(library().at_speed_update(at, now_s, said, status, encoder.handle if encoder else None))


class Shaft:
    """A spindle, its reports over a network that is late by 1 to 5 ms, and a component with a clock of its own."""

    def __init__(self, speed_rps: Callable[[float], float], report_s: float = REPORT_S) -> None:
        random.seed(5)
        self.encoder = Encoder()
        self.speed_rps, self.report_s = speed_rps, report_s
        self.before_index = 0.0  # so much more is reported until the first index pulse
        self.t = self.turns = 0.0
        self.due = 0.0
        self.on_way: list[tuple[float, int, Status]] = []

    @property
    def now(self) -> float:
        return 1000.0 + self.t

    def report(self) -> None:
        speed = self.speed_rps(self.t)
        more = self.before_index if math.floor(self.turns) == 0 else 0.0
        at = math.floor((self.turns + more) * 65536)
        turns = (at // 65536 - 5) % 2**32  # the counter wraps, too
        status = Status(spindle_angle=at % 65536, spindle_turns=turns, rpm=round(abs(speed) * 60))
        late = self.now + random.uniform(0.001, 0.005)
        self.on_way.append((late, (BOOT_US + round(self.t * 1e6)) % 2**32, status))

    def run(self, seconds: float, index_enable: bool = False) -> tuple[list[float], bool]:
        """Every ms: position as on the pin less true position. @return those, and index_enable at the end"""
        errors = []
        for _ in range(round(seconds * 1000)):
            self.t += 0.001
            self.turns += 0.001 * self.speed_rps(self.t)
            if self.t >= self.due:
                self.due += self.report_s
                self.report()
            while self.on_way and self.on_way[0][0] <= self.now:
                _, device_us, status = self.on_way.pop(0)
                self.encoder.take(device_us, self.now, status)
            position, index_enable = self.encoder.update(self.now, index_enable)
            errors.append(position - self.turns)
        return errors, index_enable


@pytest.mark.parametrize("speed", [0.3, 10.0, 83.3, -10.0, -50.0])
@pytest.mark.parametrize("report_s", [0.01, 0.05])
def test_position_and_speed(speed: float, report_s: float) -> None:
    """To 5000 rpm, 4 turns between two reports. It lags by the fastest datagram, 1 ms, and a report's rounding."""
    shaft = Shaft(lambda _: speed, report_s)
    shaft.run(1)
    errors, _ = shaft.run(2)
    whole = round(errors[-1])
    assert max(abs(error - whole) for error in errors) <= 0.003 * abs(speed) + 2e-4
    assert shaft.encoder.speed_rps == pytest.approx(speed, rel=0.002)


@pytest.mark.parametrize("speed", [10.0, -10.0])
def test_the_index_sets_the_position_to_zero_and_clears_index_enable(speed: float) -> None:
    """Where the index is, not where it was noticed; and only the next one."""
    shaft = Shaft(lambda _: speed, 0.01)
    shaft.run(1.03)
    before = shaft.turns
    index_enable, taken = True, 0
    while index_enable:
        _, index_enable = shaft.run(0.001, index_enable)
        taken += 1
    assert taken * 0.001 <= 0.1 + 0.004, "a turn takes 0.1 s"
    index = math.ceil(before) if speed > 0 else math.floor(before)
    errors, again = shaft.run(0.5)
    assert all(error == pytest.approx(-index, abs=0.04) for error in errors) and not again


@pytest.mark.parametrize("before_index", [0.375, 0.6, 0.96])
@pytest.mark.parametrize("speed", [5.0, -5.0])
def test_the_first_index_after_power_on(speed: float, before_index: float) -> None:
    """The device has counted from where the spindle stood, and a whole turn there is no index. Its speed continues."""
    shaft = Shaft(lambda _: speed, 0.01)
    shaft.before_index = before_index
    shaft.turns = 0.35 if speed > 0 else 0.65
    shaft.run(0.05)
    armed, turned = True, shaft.turns
    while armed:
        errors, armed = shaft.run(0.005, armed)
        assert shaft.encoder.speed_rps == pytest.approx(speed, rel=0.01)
    assert errors[-1] == pytest.approx(round(errors[-1]), abs=0.06), "0 is at an index"
    assert abs(shaft.turns - turned) <= 2.1


def test_a_standing_spindle_has_no_index() -> None:
    shaft = Shaft(lambda _: 0.0)
    shaft.run(0.5)
    errors, index_enable = shaft.run(2, True)
    assert index_enable and errors[-1] == 0.0 and shaft.encoder.speed_rps == 0.0


def test_a_spindle_that_turns_back() -> None:
    """As in rigid tapping: 10 turns/s, through rest, and back, within half a second."""
    shaft = Shaft(lambda t: max(-10.0, min(10.0, 10.0 - 40.0 * (t - 1.0))) if t > 1.0 else 10.0, 0.01)
    errors, _ = shaft.run(4)
    assert errors[-1] == pytest.approx(0.0, abs=0.03), "not a turn is lost"
    assert shaft.encoder.speed_rps == pytest.approx(-10.0, rel=0.002)


def test_reports_that_are_lost_or_late() -> None:
    encoder = Encoder()
    for n in (0, 1, 2, 5, 4, 6, 6, 9):  # every 10 ms at 20 turns/s: a fifth of a turn each
        turns = n * 0.2 + 1e-9
        encoder.take(10_000 * n, 0.01 * n, Status(spindle_angle=int(turns % 1.0 * 65536), spindle_turns=int(turns)))
    assert encoder.turns(0.09) == pytest.approx(1.8, abs=1e-4)


def test_the_position_does_not_run_away_without_reports() -> None:
    shaft = Shaft(lambda _: 10.0, 0.01)
    shaft.run(1)
    assert shaft.encoder.turns(shaft.now + 60) <= shaft.turns + 1.1


def test_at_speed_with_an_encoder() -> None:
    shaft = Shaft(lambda t: min(10.0, 5.0 * t), 0.01)
    at_speed, wanted = AtSpeed(), (1, 600)
    seen = []
    for _ in range(300):
        shaft.run(0.01)
        seen.append(is_at_speed(at_speed, shaft.now, wanted, Status(spindle=1, rpm=600), shaft.encoder))
    first = seen.index(True) * 0.01
    assert 1.9 <= first <= 2.0, "5 turns/s2: 95 % after 1.9 s; the speed is a mean over 70 ms"
    assert all(seen[seen.index(True) :])
    assert is_at_speed(at_speed, shaft.now, (0, 0), Status(), shaft.encoder), "nothing waits for a spindle that is off"


def test_at_speed_without_an_encoder() -> None:
    at_speed = AtSpeed(3.0)
    assert not is_at_speed(at_speed, 0.0, (1, 600), Status(spindle=0), None), "not even switched"
    assert not is_at_speed(at_speed, 2.9, (1, 600), Status(spindle=1, rpm=600), None)
    assert is_at_speed(at_speed, 3.0, (1, 600), Status(spindle=1, rpm=600), None)
    assert not is_at_speed(at_speed, 3.1, (1, 900), Status(spindle=1, rpm=600), None), "another speed: it runs up again"
