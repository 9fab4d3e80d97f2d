"""LinuxCNC with a laser: the beam is on in cuts only; and outputs that the board lacks are reported."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from link_bench import SCALE, Bench, MotionType, mover

CUTS = {MotionType.FEED, MotionType.ARC}


def laser(make_bench: Callable[..., Bench]) -> Bench:
    bench = make_bench({32: 1, 30: 1000})
    bench.enable()
    bench.pins["spindle-on"], bench.pins["spindle-rpm"] = True, 800.0
    bench.run(0.5)
    return bench


def powers(bench: Bench, seconds: float) -> set[int]:
    """Of the laser, looked at every ms."""
    seen, each = set(), bench.each_servo

    def look() -> None:
        each()
        seen.add(bench.virtual.duty())

    bench.each_servo = look
    bench.run(seconds)
    bench.each_servo = each
    return seen


@pytest.mark.parametrize("kind", MotionType)
def test_the_beam_is_on_in_cuts_only(make_bench: Callable[..., Bench], kind: MotionType) -> None:
    """After M3, with $32=1: a G0, a jog (no type) and what else is no G1, G2 or G3 moves in the dark."""
    bench = laser(make_bench)
    bench.motion_type = kind
    bench.each_servo = mover(bench, 0, 10.0, 20.0)
    seen = powers(bench, 2)
    assert bench.virtual.position[0] == 10 * SCALE and not bench.pins["fault"]
    assert seen == ({0, round(0.8 * 65535)} if kind in CUTS else {0})


def test_a_rapid_behind_a_cut_is_dark_from_its_first_step_on(make_bench: Callable[..., Bench]) -> None:
    bench = laser(make_bench)
    bench.each_servo = mover(bench, 0, 10.0, 20.0)
    assert max(powers(bench, 2)) > 0
    bench.motion_type = MotionType.TRAVERSE
    bench.each_servo = mover(bench, 0, 0.0, 20.0)
    assert powers(bench, 2) == {0}
    bench.motion_type = MotionType.FEED
    bench.each_servo = mover(bench, 0, 10.0, 20.0)
    assert max(powers(bench, 2)) > 0


def test_a_spindle_or_coolant_that_the_board_lacks_is_reported(make_bench: Callable[..., Bench]) -> None:
    bench = make_bench(missing_outputs=8)
    bench.enable()
    bench.pins["mist"] = True
    bench.run(0.5)
    assert not bench.pins["fault"]
    bench.pins["flood"] = True
    bench.run(0.5)
    assert bench.pins["fault"] and bench.pins["message.refused"]
    assert any("no output" in text for text in bench.said)
    bench.pins["flood"], bench.pins["enable"] = False, False
    bench.run(0.5)
    bench.press_reset()
    bench.run(1)
    bench.switch_on()
    bench.run(1)
    assert bench.is_open and not bench.pins["fault"], "it is given up, and switched on again"
