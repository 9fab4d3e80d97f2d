"""A gantry with two motors on Y at the pins of the real image: motors and switches of the virtual chip."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from chip_controller import BANNER, Controller
from image_fixture import build_image
from mips.isr import SELDOM, disassemble, longest_path, read_disassembly
from slow import cases_but, deep_but
from store_pages import pages as stored_pages
from wificnc.board.load import load_board
from wificnc.board.model import Board
from wificnc.build.image import Block, read_hex
from wificnc.build.pic32mz import Pic32Build
from wificnc.simulator.run import SimOptions
from wificnc_chips import as_axes, run_on_chip
from wificnc_chips.pic32mz import CPU_HZ, NO_PIN, STORE_OFFSET, motor_wire

pytestmark = pytest.mark.slow  # tests/grbl has quick ones

FIRST, SECOND = 1, 3  # motors of Y
HIGH, PULL_OFF = 1007, 500


@pytest.fixture(scope="module")
def board() -> Board:
    return load_board("pic32mz-gantry")


@pytest.fixture(scope="module")
def build(board: Board) -> Pic32Build:
    return build_image(board)


@pytest.fixture(scope="module")
def reference() -> Pic32Build:
    """The same connectors, with an axis A."""
    return build_image(load_board("pic32mz2048efh100"))


@pytest.fixture(scope="module")
def image(build: Pic32Build) -> tuple[Block, ...]:
    return read_hex(build.hex.read_text())


@pytest.fixture(scope="module")
def four_axes(reference: Pic32Build) -> tuple[tuple[Block, ...], bytes]:
    """The image, and pages in which the driver of A is the second motor of Y."""
    image = read_hex(reference.hex.read_text())
    with Controller(load_board("pic32mz2048efh100"), image) as controller:
        controller.boot()
        controller.fine("$211=4")
        controller.run(0.5)
        return image, stored_pages(controller)


# The second one is the driver of A by a setting, in the image that other tests use, too, or the board's.
MOTORS = deep_but("$211=4".__eq__, ["$211=4", "board"])


@pytest.fixture(params=MOTORS)
def gantry(request: pytest.FixtureRequest) -> Iterator[Controller]:
    """Homes Y to its far end."""
    by_setting = request.param != "board"
    four_axes = request.getfixturevalue("four_axes") if by_setting else ()
    image = four_axes[0] if by_setting else request.getfixturevalue("image")
    with Controller(load_board("pic32mz2048efh100" if by_setting else "pic32mz-gantry"), image) as controller:
        if by_setting:
            controller.chip.set_flash(STORE_OFFSET, four_axes[1])
            controller.chip.power_on()
        controller.boot()
        controller.fine("$22=1", "$24=100", "$25=2000", "$26=25", "$27=2", "$44=2", "$45=0", "$101=250")
        controller.fine("$111=5000", "$121=500", "$131=100", "$X")
        for motor in (FIRST, SECOND):
            controller.switches(motor, None, HIGH)
        yield controller


def crooked(gantry: Controller, at: int, skew: int) -> None:
    """The second motor is `skew` steps beyond the first."""
    gantry.chip.place(FIRST, at)
    gantry.chip.place(SECOND, at + skew)
    gantry.run(0.02)
    gantry.steps()


def stands(gantry: Controller) -> tuple[int, int]:
    return gantry.chip.position(FIRST), gantry.chip.position(SECOND)


@pytest.mark.parametrize("skew", deep_but({0, -1, 37, -1200}.__contains__, [0, 1, -1, 37, -250, 1000, -1200]))
def test_both_motors_end_a_pull_off_before_their_switches(gantry: Controller, skew: int) -> None:
    """Square to the step, however crooked it was; and from then on both make every step."""
    crooked(gantry, -4000, skew)
    assert gantry.send("$HY", 60.0) == "ok\r\n"
    gantry.rest()
    assert stands(gantry) == (HIGH - PULL_OFF, HIGH - PULL_OFF)
    gantry.fine("G91G0Y-3X1")
    gantry.rest()
    assert stands(gantry) == (HIGH - PULL_OFF - 750, HIGH - PULL_OFF - 750)


def test_a_second_motor_that_is_mounted_the_other_way_round(gantry: Controller) -> None:
    """$8: what the chip counts at the second motor's pins is the other way, the gantry is square."""
    wire = motor_wire(gantry.board, SECOND, low=-HIGH)
    wire.min_switch, wire.min_active = wire.max_switch, wire.max_active  # the end that is far for the gantry
    wire.max_switch = NO_PIN
    gantry.chip.set_axis(SECOND, wire)
    gantry.fine("$8=2")
    gantry.chip.place(FIRST, -3000)
    gantry.chip.place(SECOND, 2700)
    gantry.run(0.02)
    assert gantry.send("$HY", 60.0) == "ok\r\n"
    gantry.rest()
    assert stands(gantry) == (HIGH - PULL_OFF, -(HIGH - PULL_OFF))


def test_lines_that_the_board_calls_active_low(laden_board: Board, laden_image: tuple[Block, ...]) -> None:
    """They rest high, the pulse is low, and low is the negative direction."""
    with Controller(laden_board, laden_image) as gantry:
        gantry.boot()
        step, direction = gantry.pin("step_y2"), gantry.pin("dir_y2")
        assert (gantry.chip.level(step), gantry.chip.level(direction)) == (1, 1)
        gantry.chip.record_edges(True)
        gantry.fine("G91G1Y-1F900")
        gantry.rest()
        edges = [(pin, level) for _, pin, level in gantry.chip.edges() if pin in (step, direction)]
        assert edges[:3] == [(direction, 0), (step, 0), (step, 1)]
        assert edges.count((step, 0)) == edges.count((step, 1)) == 250
        assert gantry.chip.level(gantry.pin("step_y")) == 0


def test_each_motor_has_its_own_pull_off(gantry: Controller) -> None:
    gantry.fine("$201=3")
    crooked(gantry, -2000, -90)
    assert gantry.send("$HY", 60.0) == "ok\r\n"
    gantry.rest()
    assert stands(gantry) == (HIGH - PULL_OFF, HIGH - 750)


def test_both_motors_stop_at_one_switch(gantry: Controller) -> None:
    """$206: only the first one's counts, and the difference of the pull-offs is made once."""
    gantry.fine("$206=2", "$201=3")
    crooked(gantry, -2000, 90)
    for _ in range(2):
        assert gantry.send("$HY", 60.0) == "ok\r\n"
        gantry.rest()
        assert stands(gantry) == (HIGH - PULL_OFF, HIGH - 750 + 90)


@pytest.mark.parametrize("skew", [1800, -1800])
def test_more_than_squaring_allows_is_alarm_10(gantry: Controller, skew: int) -> None:
    """5 % of the travel (100 mm) is as far as one side goes alone; afterwards no one waits."""
    crooked(gantry, -4000, skew)
    assert "ALARM:10\r\n" in gantry.send("$HY", 60.0) + gantry.run(0.5)
    first, second = stands(gantry)
    assert abs(second - first) == pytest.approx(abs(skew) - 5 * 250, abs=1)
    gantry.send("$X")
    gantry.fine("G91G0Y-1")
    gantry.rest()
    assert stands(gantry) == (first - 250, second - 250)


STOPS, MOMENTS_S = ["estop", "reset"], [0.3, 0.9, 1.3, 1.8, 2.2, 2.6, 3.0]


def by_turns(stop: str, moment_s: float) -> bool:
    return MOMENTS_S.index(moment_s) % 2 == STOPS.index(stop)


@pytest.mark.alike(4)
@pytest.mark.parametrize(("stop", "moment_s"), cases_but(by_turns, STOPS, MOMENTS_S))
def test_interrupted_at_any_moment(gantry: Controller, stop: str, moment_s: float) -> None:
    """Both motors step afterwards, whichever of them has waited, and homing works."""
    crooked(gantry, -2500, -700)
    gantry.chip.write(b"$HY\n")
    gantry.run(moment_s)
    if stop == "estop":
        gantry.at(0.0, "estop", 1)
        gantry.run(0.05)
        gantry.at(0.0, "estop", 0)
        gantry.run(0.05)
    assert BANNER in gantry.realtime("\x18", 2.0)
    gantry.send("$X")
    first, second = stands(gantry)
    gantry.fine("G91G0Y-1")
    gantry.rest()
    assert stands(gantry) == (first - 250, second - 250)
    assert gantry.send("$HY", 60.0) == "ok\r\n"
    gantry.rest()
    assert stands(gantry) == (HIGH - PULL_OFF, HIGH - PULL_OFF)


@pytest.mark.parametrize("pulse_us", [3, 255])
def test_no_pulse_is_cut_short_when_a_motor_begins_to_wait(gantry: Controller, pulse_us: int) -> None:
    """The task may look before the last pulse has ended: the motor that waits must see its end."""
    gantry.fine("$110=340", "$111=340", "$112=340")  # what is possible with the longest pulse
    gantry.fine(f"$0={pulse_us}")
    crooked(gantry, -300, 400)
    assert gantry.send("$HY", 120.0) == "ok\r\n"
    gantry.rest()
    assert stands(gantry) == (HIGH - PULL_OFF, HIGH - PULL_OFF)
    pulses = gantry.chip.pulses()
    second = "step_y2" if gantry.board.ganged_axes else "step_a"
    assert min(pulses.high, pulses.low) >= pulse_us * 1e-6 * CPU_HZ
    assert [gantry.chip.level(gantry.pin(signal)) for signal in ("step_y", second)] == [0, 0]


@pytest.mark.deep
def test_a_second_motor_costs_the_interrupts_nothing(build: Pic32Build, reference: Pic32Build) -> None:
    """The longest paths of the step and of the end of a pulse are those of the board without a gantry."""
    programs = [read_disassembly(disassemble(made.elf)) for made in (build, reference)]
    for vector, without in (("_vector_step", SELDOM), ("_vector_step", ()), ("_vector_pulse_end", ())):
        gantry, other = (longest_path(program, vector, without) for program in programs)
        assert 0 < gantry <= other, vector


def test_the_second_switch_is_a_hard_limit(gantry: Controller) -> None:
    gantry.fine("$21=1")
    crooked(gantry, 0, 200)
    gantry.fine("G91G1Y20F3000")
    gantry.run(1.0)
    assert "ALARM:1\r\n" in gantry.heard
    assert stands(gantry) == (HIGH - 200, HIGH)


def test_only_the_motor_that_is_behind_steps_alone_within_the_limits(gantry: Controller) -> None:
    """Neither motor is faster than $25, and the one that waits for the other shows no edge. A tick of the timer and
    the 1/256 step that a segment's ends are rounded to are no speed; nor is a step that meets the interrupt of a
    switch and waits for it, at most 3 us, while the next one is in time."""
    crooked(gantry, -2500, -700)
    assert gantry.send("$HY", 60.0) == "ok\r\n"
    gantry.rest()
    steps = gantry.steps()
    for motor in (FIRST, SECOND):
        cycles = steps["cycle"][(steps["step"] >> motor & 1) == 1].astype(np.int64)
        intervals_s, least_s = np.diff(cycles) / CPU_HZ, 60 / 2000 / 250
        assert intervals_s.min() >= least_s - 3e-6
        assert np.quantile(intervals_s, 0.001) >= least_s * (1 - 1 / 256) - 20e-9
    both = 1 << FIRST | 1 << SECOND
    assert set(steps["step"] & both) == {both, 1 << SECOND}
    alone = steps["dir"][steps["step"] & both == 1 << SECOND] >> SECOND & 1
    assert len(alone) - 2 * alone.sum(dtype=np.int64) == 700


@pytest.mark.deep
def test_a_job_makes_the_hosts_steps_with_both_motors(board: Board, build: Pic32Build, tmp_path: Path) -> None:
    job = tmp_path / "job.nc"
    job.write_text("G21G90\nG1X5F1500\nG2X8Y3I0J3\nG1X0Y0\n")
    done = run_on_chip(board, SimOptions(job, board.id), ["$8=2", "$3=2"])
    assert done.first_difference is None and done.same_path and done.events > 1000


def test_a_second_motor_that_does_otherwise_is_a_difference() -> None:
    """Motor 3 is the second one of axis 1: both step, in the same direction; or not."""
    axis = (0, 1, 2, 1)
    assert as_axes([(0b1010, 0b1010), (0b1010, 0), (0b101, 0)], axis) == [(0b10, 0b1010), (0b10, 0), (0b101, 0)]
    assert as_axes([(0b0010, 0), (0b1000, 0), (0b1010, 0b1000)], axis) == [(0b0010, 0), (0b1000, 0), (0b1010, 0b1000)]
