"""The dial: exact detents, a bounded way, and nothing that is done later (docs/dial.md)."""

from __future__ import annotations

import random
from collections.abc import Callable

import pytest
from c_library import LIB
from dial_grbl import REST_S, STEPS_MM, DialGrbl, make
from driver_grbl import HOT, DriverGrbl
from grbl_host import HZ, Grbl, add_drivers
from wificnc.simulator.library import HostBoard, Tasks

FEED_MM_S, ACCEL_MM_S2 = 30.0, 500.0
BOUND_MM = FEED_MM_S**2 / (2 * ACCEL_MM_S2)
IGNORED = "[MSG:Dial ignored: let it rest, then turn it while nothing else moves]\r\n"
ENDS = "[MSG:Dial: the travel ends here]\r\n"
TASKS = [Tasks.FREE, Tasks.ESP32, Tasks.PIC32MZ]


@pytest.mark.parametrize("tasks", TASKS)
@pytest.mark.parametrize("step_mm", [0.001, 0.01, 0.1, 1.0])
def test_each_detent_is_its_distance(tasks: Tasks, step_mm: float) -> None:
    rng = random.Random(7)
    grbl = make(f"$401={step_mm}", tasks=tasks)
    place = 0
    for _ in range(12):
        detents = rng.choice([-3, -1, 1, 2, 5])
        place += detents
        assert grbl.turned(detents, per_s=5 if step_mm == 1.0 else 50) == ""
        assert abs(grbl.position()[0] - place * step_mm * STEPS_MM) <= 0.5
        assert grbl.state() == "Idle"
    assert grbl.position()[1:] == [0] * 5
    grbl.close()


@pytest.mark.parametrize("tasks", TASKS)
@pytest.mark.parametrize("per_s", [30.0, 100.0, 400.0, 3000.0])
@pytest.mark.parametrize("step_mm", [0.01, 0.1, 1.0])
def test_the_axis_stops_within_its_stopping_distance(tasks: Tasks, per_s: float, step_mm: float) -> None:
    """v^2 / 2a from $402, by the step edges after the last edge of the dial; a detent where that is longer."""
    grbl = make(f"$401={step_mm}", tasks=tasks)
    detents = round(per_s * 0.7)
    before_s = grbl.time()
    said = grbl.after(grbl.turn(detents, per_s))
    stopped_s = grbl.time()
    said += grbl.after(3.0)
    at_stop, end = grbl.x_at(stopped_s), grbl.position()[0]
    assert end >= at_stop
    assert (end - at_stop) / STEPS_MM <= max(BOUND_MM, step_mm) + 1 / STEPS_MM
    # Position: on a detent, and as many as were not dropped.
    made = round(end / STEPS_MM / step_mm)
    assert abs(end - made * step_mm * STEPS_MM) <= 0.5
    dropped = detents - made
    follows = per_s * step_mm < FEED_MM_S / 3 and step_mm < BOUND_MM
    assert dropped == 0 if follows else dropped >= 0
    if dropped:
        assert "[MSG:Dial: turned too fast, " in said
        assert said.count("[MSG:") <= 1 + (grbl.time() - before_s) // 5
    grbl.close()


def test_all_that_is_dropped_is_reported() -> None:
    grbl = make()
    said = grbl.turned(400, per_s=500.0) + grbl.after(6.0)
    told = sum(int(part.split(" ")[0]) for part in said.split("too fast, ")[1:])
    assert grbl.position()[0] == (400 - told) * 25
    grbl.close()


@pytest.mark.parametrize("tasks", TASKS)
def test_a_dial_that_turns_back_brakes_first(tasks: Tasks) -> None:
    grbl = make(tasks=tasks)
    grbl.after(grbl.turn(150, 300.0))
    at_turn, begin = grbl.position()[0], grbl.time()
    grbl.after(grbl.turn(-3, 30.0) + 2.0)
    _times, at = grbl.edges()
    peak, end = int(at.max()), grbl.position()[0]
    assert at_turn <= peak <= at_turn + (BOUND_MM * STEPS_MM) + 1
    assert end % 25 == 0
    # The detent on which it would have stopped, and three back.
    goal = -(-peak // 25)
    assert end == 25 * (goal - 3)
    assert abs(grbl.accelerations()).max() <= 1.2 * ACCEL_MM_S2 * STEPS_MM + 4 / 0.01**2  # whole steps in 10 ms
    assert grbl.time() > begin
    grbl.close()


def test_a_line_that_bounces_moves_nothing() -> None:
    grbl = make()
    for at in range(40):
        grbl.input_in(0.0003 * (at + 1), "dial-line-a", at % 2 == 0)
    assert grbl.after(1.0) == ""
    assert grbl.position()[0] == 0
    assert grbl.turned(1) == ""
    assert grbl.position()[0] == 25
    grbl.close()


def test_impossible_signals_are_counted_in_one_message() -> None:
    grbl = make()
    said = ""
    for _ in range(200):
        LIB.virtual_dial_slip(grbl._host)
        said += grbl.after(0.05)
    assert 1 <= said.count("impossible signals; check its cable, shield and ground]") <= 3
    assert grbl.position()[0] == 0
    said += grbl.after(6.0)
    assert sum(int(part.split(" ")[0]) for part in said.split("[MSG:Dial: ")[1:]) == 200
    grbl.close()


def check_mode(grbl: DialGrbl) -> None:
    grbl.after(0.1, "$C\n")


def alarm(grbl: DialGrbl) -> None:
    grbl.input("limit-x", True)
    grbl.after(0.1)
    grbl.input("limit-x", False)


def hold(grbl: DialGrbl) -> None:
    grbl.after(0.3, "G1X50F600\n!")


def door(grbl: DialGrbl) -> None:
    grbl.input("door", True)
    grbl.after(0.1)


def sleep(grbl: DialGrbl) -> None:
    grbl.after(0.1, "$SLP\n")


def run(grbl: DialGrbl) -> None:
    grbl.after(0.1, "G1X50F600\n")


def jog(grbl: DialGrbl) -> None:
    grbl.after(0.1, "$J=G91X50F600\n")


def mpg(grbl: DialGrbl) -> None:
    LIB.host_set_mpg(grbl._host, True)


def pause(grbl: DialGrbl) -> None:
    grbl.after(0.1, "M0\n")


STATES: list[tuple[Callable[[DialGrbl], None], str]] = [
    (check_mode, "Check"), (hold, "Hold:0"), (door, "Door:1"), (sleep, "Sleep"), (run, "Run"), (jog, "Jog"),
    (mpg, "Idle"), (pause, "Hold:0"),
]  # fmt: skip


@pytest.mark.parametrize(("enter", "state"), STATES)
def test_counts_of_a_state_that_refuses_are_dropped(enter: Callable[[DialGrbl], None], state: str) -> None:
    grbl = make()
    enter(grbl)
    assert grbl.state() == state
    grbl.turn(-8, 40.0)  # away from where a job goes
    said = grbl.after(0.6)
    assert said == IGNORED
    assert grbl.state() == state
    before = grbl.position()[0]
    said = grbl.after(0.0, "\x18") + grbl.after(1.0, "$X\n")
    LIB.host_set_mpg(grbl._host, False)
    if state == "Door:1":
        grbl.input("door", False)
        grbl.after(2.0, "~")
    grbl.after(1.0, "$X\n")
    after = grbl.position()[0]
    grbl.after(3.0)
    assert grbl.position()[0] == after >= before
    # ... and what comes then counts.
    grbl.turned(-2)
    assert grbl.position()[0] == after - 50
    grbl.close()


def test_an_alarm_drops_counts() -> None:
    grbl = make("$21=1")
    alarm(grbl)
    grbl.after(1.0)
    assert grbl.state() == "Alarm"
    assert grbl.turned(5) == IGNORED
    grbl.after(0.2, "\x18")
    assert "ok" in grbl.after(1.0, "$X\n")
    assert grbl.position()[0] == 0
    grbl.turned(5)
    assert grbl.position()[0] == 125
    grbl.close()


def test_a_hand_that_turns_when_a_job_ends_moves_nothing() -> None:
    """It would be a surprise: the wheel must rest once, and then it moves the axis."""
    grbl = make()
    grbl.after(0.01, "G1X1F600\n")
    grbl.turn(60, 20.0)  # 3 s, the job takes 0.1 s
    grbl.after(3.5)
    assert grbl.position()[0] == 250
    assert grbl.state() == "Idle"
    grbl.turned(1)
    assert grbl.position()[0] == 275
    grbl.close()


@pytest.mark.parametrize("stop", ["\x85", "!"])
def test_jog_cancel_and_hold_stop_the_dial(stop: str) -> None:
    grbl = make()
    grbl.turn(300, 100.0)  # 3 s
    grbl.after(0.5)
    assert grbl.state() == "Jog"
    asked = grbl.time()
    grbl.after(0.5, stop)
    at_stop, rest = grbl.x_at(asked), grbl.position()[0]
    assert rest - at_stop <= BOUND_MM * STEPS_MM
    assert grbl.state() == "Idle"
    grbl.after(2.5)  # the hand still turns
    assert grbl.position()[0] == rest
    grbl.after(REST_S)
    grbl.turned(1)
    assert grbl.position()[0] == rest + 25
    grbl.close()


def test_an_opened_door_stops_the_dial() -> None:
    grbl = make()
    grbl.turn(300, 100.0)
    grbl.after(0.5)
    grbl.input("door", True)
    asked = grbl.time()
    grbl.after(1.0)
    assert grbl.position()[0] - grbl.x_at(asked) <= BOUND_MM * STEPS_MM
    rest = grbl.position()[0]
    grbl.input("door", False)
    grbl.after(4.0, "~")
    assert grbl.position()[0] == rest
    grbl.close()


def test_a_senders_line_waits_for_the_dial_and_comes_before_more_of_it() -> None:
    grbl = make()
    grbl.turn(300, 100.0)
    grbl.after(0.5)
    asked = grbl.time()
    said = grbl.after(0.01, "G1Y1F600\n")
    assert said == ""  # not error:9, as in a jog of a client
    said = grbl.after(1.5)
    assert said.startswith("ok\r\n")
    at_line = grbl.x_at(asked)
    assert grbl.position()[1] == 250
    assert grbl.position()[0] - at_line <= BOUND_MM * STEPS_MM + 25
    assert grbl.position()[0] % 25 == 0
    grbl.close()


def test_a_pendant_is_not_read_while_the_dial_moves() -> None:
    grbl = make()
    assert LIB.host_reads(grbl._host) == 2  # MACHINE_READS_LINES
    grbl.turn(300, 100.0)
    grbl.after(0.5)
    assert LIB.host_reads(grbl._host) == 0  # MACHINE_READS_NOTHING: error:183
    grbl.after(3.5)
    assert LIB.host_reads(grbl._host) == 2
    grbl.close()


@pytest.mark.parametrize("clamps", [0, 1])
def test_the_travel_ends_the_dial(clamps: int) -> None:
    grbl = make("$130=100.05", f"$56={clamps}", "$22=1", "$20=1")
    said = grbl.turned(-1100, 150.0)
    while grbl.position()[0] > -99 * 250:
        said += grbl.turned(-400, 150.0)
    said += grbl.turned(-20) + grbl.after(6.0)
    assert grbl.position()[0] == (-25013 if clamps else -25000)
    assert ENDS in said
    assert "error" not in said and "ALARM" not in said
    grbl.turned(1)
    assert grbl.position()[0] == (-25013 if clamps else -25000) + 25
    grbl.close()


@pytest.mark.parametrize("tasks", TASKS)
def test_in_a_parked_hold_it_moves_what_the_operator_may(tasks: Tasks) -> None:
    grbl = make(tasks=tasks)
    grbl.after(0.5, "G1X2F600\nM0\n")
    assert grbl.turned(3) == IGNORED  # a plain pause
    assert "Parked" in grbl.after(0.5, "\xa3")
    assert grbl.turned(6) == ""
    assert grbl.position()[0] == 500 + 150
    grbl.after(grbl.turn(200, 200.0))
    stopped_s = grbl.time()
    grbl.after(1.5)
    assert grbl.position()[0] - grbl.x_at(stopped_s) <= BOUND_MM * STEPS_MM + 1
    assert grbl.position()[0] % 25 == 0
    assert "ok" in grbl.after(3.0, "~")
    assert grbl.position()[0] == 500
    assert grbl.state() == "Idle"
    grbl.close()


def test_its_switches_select_axis_and_distance() -> None:
    grbl = make("$401=0.01", selects=True)
    assert grbl.turned(3) == IGNORED  # no axis
    grbl.input("dial-y", True)
    grbl.after(REST_S)
    grbl.turned(4)
    assert grbl.position() == [0, 10, 0, 0, 0, 0]
    grbl.input("dial-x10", True)
    grbl.turned(2)
    assert grbl.position() == [0, 60, 0, 0, 0, 0]
    grbl.input("dial-x10", False)
    grbl.input("dial-x100", True)
    grbl.turned(-1)
    assert grbl.position() == [0, -190, 0, 0, 0, 0]
    grbl.input("dial-z", True)  # between two positions
    grbl.turned(5)
    assert grbl.position() == [0, -190, 0, 0, 0, 0]
    grbl.input("dial-y", False)
    grbl.after(REST_S)
    grbl.turned(1)
    assert grbl.position() == [0, -190, 250, 0, 0, 0]
    grbl.close()


def test_a_switch_that_is_turned_in_motion_counts_at_rest() -> None:
    grbl = make(selects=True)
    grbl.input("dial-x", True)
    grbl.turn(200, 100.0)
    grbl.after(0.5)
    grbl.input("dial-x", False)
    grbl.input("dial-y", True)
    grbl.after(3.0)
    assert grbl.position()[1] == 0
    assert 0 < grbl.position()[0] <= 0.7 * 100 * 25
    grbl.close()


def test_400_names_the_axis() -> None:
    grbl = make("$400=2")
    grbl.turned(2)
    assert grbl.position() == [0, 0, 50, 0, 0, 0]
    grbl.after(0.1, "$400=5\n")  # a machine of three axes
    assert grbl.turned(2) == IGNORED
    assert grbl.position() == [0, 0, 50, 0, 0, 0]
    grbl.close()


@pytest.mark.parametrize("counts", [1, 2, 4])
def test_counts_a_detent(counts: int) -> None:
    grbl = make(counts=counts)
    grbl.turned(7)
    grbl.turned(-2)
    assert grbl.position()[0] == 125
    grbl.close()


@pytest.mark.parametrize("seed", range(6))
def test_a_task_that_stalls_loses_no_detent_and_no_step(seed: int) -> None:
    rng = random.Random(seed)
    grbl = make("$401=0.05", tasks=rng.choice(TASKS))
    grbl.stall_randomly(seed, longest_ms=40, gap_ms=60)
    for _ in range(12):
        grbl.after(grbl.turn(rng.choice([-12, -5, 4, 9, 15]), rng.choice([15.0, 40.0])))
        grbl.after(rng.uniform(0.0, 0.3))
    grbl.after(2.0)
    at = grbl.position()[0]
    assert abs(at / 12.5 - round(at / 12.5)) * 12.5 <= 0.5
    assert grbl.stands()[0] == at
    grbl.close()


class WithDrivers(DriverGrbl):
    """A TMC5160 on each axis, and a dial."""

    def __init__(self) -> None:
        board = HostBoard(HZ, 1000, 500, 500_000, 3, dial=4)
        add_drivers(board, 3)
        Grbl.__init__(self, board=board)


def test_a_driver_that_gets_hot_stops_the_dial_and_the_position_stays_true() -> None:
    grbl = WithDrivers()
    grbl.set_up("$401=0.1", "$402=1800", "$746=1")
    LIB.virtual_dial(grbl._host, 300, 100.0)
    grbl.after(0.5)
    assert grbl.state() == "Jog"
    grbl.faults(0, HOT)
    grbl.until("[MSG:", 2.0)
    grbl.after(4.0)
    grbl.faults(0, 0)
    grbl.after(2.0)
    rest = grbl.position()[0]
    assert 0 < rest < 200 * 25
    assert "ok" in grbl.after(3.0, "$J=G91X1F600\n")
    assert grbl.position()[0] == rest + 250
    grbl.close()


def test_a_driver_that_gets_hot_while_the_dial_turns_back_stops_it_for_good() -> None:
    """The brake is under way already: what comes after it does not."""
    grbl = WithDrivers()
    grbl.set_up("$401=0.1", "$402=1800", "$746=1", "$120=20")
    grbl.record()
    LIB.virtual_dial(grbl._host, 200, 100.0)
    grbl.after(2.0)
    LIB.virtual_dial(grbl._host, -5, 100.0)
    grbl.after(0.06)
    grbl.faults(0, HOT)
    grbl.until("becomes too hot", 1.0)
    stopped = grbl.position()[0]
    grbl.after(6.0)
    rest = grbl.position()[0]
    assert rest > stopped  # it still braked when the fault came
    _times, at = DialGrbl.edges(grbl)  # type: ignore[arg-type]
    assert rest == at.max()
    assert grbl.state() == "Idle"
    grbl.close()


def test_slow_axes_follow_without_a_message() -> None:
    """Its end is published, and grows: that is no underrun."""
    grbl = make("$120=20")
    assert grbl.after(grbl.turn(200, 100.0) + 4.0) == ""
    assert grbl.position()[0] == 5000
    grbl.close()
