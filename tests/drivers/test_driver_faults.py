"""What can be wrong with a driver: one message, a feed hold, alarm 54; and nothing starts by itself afterwards."""

from __future__ import annotations

import operator
from collections.abc import Collection, Iterator
from functools import partial
from threading import Thread

import pytest
from c_library import LIB
from driver_grbl import (
    CHOPCONF,
    CROSSED,
    CUT,
    DEAF,
    HOT,
    IHOLD_IRUN,
    KINDS,
    NO_SUPPLY,
    NOISE,
    OPEN,
    SHORT,
    SHUT_DOWN,
    STEPS_MM,
    TMC2130,
    TMC2209,
    TMC5160,
    UNDERVOLTAGE,
    UNWIRED,
    DriverGrbl,
    make,
)
from grbl_host import HZ
from patience import HANG_S
from slow import cases_but, deep_but
from wificnc.simulator.library import Tasks

NOTICED_S = 0.3
MOVE = "G91\nG1X200Y200F1200\n"
ALARM = "ALARM:54"


@pytest.fixture(params=KINDS)
def kind(request: pytest.FixtureRequest) -> int:
    return int(request.param)


CHIPS = (
    (TMC2209, Tasks.FREE),
    (TMC5160, Tasks.FREE),
    (TMC2130, Tasks.FREE),
    (TMC2209, Tasks.ESP32),
    (TMC5160, Tasks.PIC32MZ),
)


WITHOUT_ESP32, WITHOUT_PIC32MZ = (  # in CI: those with task periods take much longer
    pytest.mark.parametrize("grbl", deep_but(partial(operator.ne, chip), CHIPS), indirect=True) for chip in CHIPS[3:]
)


@pytest.fixture(params=CHIPS)
def grbl(request: pytest.FixtureRequest) -> Iterator[DriverGrbl]:
    kind, tasks = request.param
    grbl = make(kind, tasks=tasks)
    yield grbl
    grbl.close()


def moving(grbl: DriverGrbl) -> DriverGrbl:
    said = grbl.after(0.6, MOVE)
    assert said == "ok\r\n" * 2
    assert grbl.state() == "Run"
    return grbl


def slows_within(grbl: DriverGrbl) -> float:
    """Seconds until the axes are slower than they were."""
    begin, steps = grbl.time(), []
    while len(steps) < 3 or steps[-1] - steps[-2] > 0.9 * (steps[1] - steps[0]):
        steps.append(grbl.position()[0])
        assert ALARM not in grbl.after(0.01)
        assert grbl.time() - begin < 1.0
    return grbl.time() - begin


def messages(said: str) -> list[str]:
    return [line for line in said.splitlines() if line.startswith("[MSG:Driver")]


def assert_stopped_for_good(grbl: DriverGrbl) -> None:
    """In an alarm, at rest, and it stays so."""
    grbl.after(0.6)
    assert grbl.state() == "Alarm"
    before = grbl.position()
    grbl.after(2.0)
    assert grbl.position() == before == grbl.position()


FAULTS = {
    NO_SUPPLY: "no answer. Check the motor supply",
    UNWIRED: "no answer. Check the motor supply",
    SHORT: "short circuit",
    SHUT_DOWN: "too hot, its outputs are off",
    UNDERVOLTAGE: "undervoltage. Check the motor supply",
}


def with_some_chips(of_esp32: int, of_pic32mz: int, values: Collection[int]) -> pytest.MarkDecorator:
    """Every value with each kind of driver where tasks have no periods; where they have, which takes much longer, one
    of them."""
    kept = {CHIPS[3]: of_esp32, CHIPS[4]: of_pic32mz}
    cases = cases_but(lambda chip, fault: kept.get(chip, fault) == fault, CHIPS, values)
    return pytest.mark.parametrize(("grbl", "fault"), cases, indirect=["grbl"])


@pytest.mark.alike(8)
@with_some_chips(NO_SUPPLY, SHORT, FAULTS)
def test_a_fault_in_mid_job_is_one_message_a_stop_within_the_limits_and_an_alarm(grbl: DriverGrbl, fault: int) -> None:
    text = FAULTS[fault]
    grbl.record()
    moving(grbl)
    grbl.faults(1, fault)
    assert slows_within(grbl) <= NOTICED_S
    said = grbl.until(ALARM, 1.0)[0]
    told = messages(said)
    assert len(told) == 1
    assert told[0].startswith(f"[MSG:Driver Y: {text}")
    assert_stopped_for_good(grbl)
    assert abs(grbl.accelerations()).max() <= 500 * STEPS_MM * 1.3  # what a box of 10 ms sees of whole steps


def test_one_supply_for_all_is_one_message(grbl: DriverGrbl) -> None:
    for ax in range(3):
        grbl.faults(ax, NO_SUPPLY)
    said = grbl.after(2.0)
    assert messages(said) == ["[MSG:Driver X Y Z: no answer. Check the motor supply, its bus wires and its address]"]
    assert said.index("[MSG:Driver") < said.index(ALARM)


@WITHOUT_ESP32
def test_a_supply_that_comes_back_writes_all_registers_and_starts_nothing(grbl: DriverGrbl) -> None:
    moving(grbl)
    irun, chopconf = grbl.register(1, IHOLD_IRUN), grbl.register(1, CHOPCONF)
    grbl.faults(1, NO_SUPPLY)
    grbl.until(ALARM, 1.0)
    grbl.after(1.0)
    said = grbl.after(0.3, "\x18")
    assert messages(said) == ["[MSG:Driver Y: no answer. Check the motor supply, its bus wires and its address]"]
    assert grbl.after(0.05, "$X\n") == "error:194\r\n"
    assert "|Pn:M" in grbl.status()
    grbl.faults(1, 0)
    assert "[MSG:Driver Y: it answers again]" in grbl.after(1.5)
    assert (grbl.register(1, IHOLD_IRUN), grbl.register(1, CHOPCONF)) == (irun, chopconf)
    assert_stopped_for_good(grbl)
    assert grbl.after(0.05, "$X\n") == "[MSG:Caution: Unlocked]\r\nok\r\n"
    assert grbl.state() == "Idle"


@WITHOUT_PIC32MZ
def test_a_reset_in_mid_job_is_noticed_and_the_registers_are_written_again(grbl: DriverGrbl) -> None:
    moving(grbl)
    irun, chopconf = grbl.register(1, IHOLD_IRUN), grbl.register(1, CHOPCONF)
    grbl.reset_driver(1)
    assert slows_within(grbl) <= NOTICED_S
    said = grbl.until(ALARM, 1.0)[0]
    assert "[MSG:Driver Y: it was reset. Check the motor supply]" in said
    assert len(messages(said)) == 1
    assert_stopped_for_good(grbl)
    assert (grbl.register(1, IHOLD_IRUN), grbl.register(1, CHOPCONF)) == (irun, chopconf)
    assert grbl.rows()[1][3] == "ok"
    assert grbl.rows()[1][-1] == "1"


@with_some_chips(HOT, OPEN, [HOT, OPEN])
def test_a_warning_holds_the_job_and_it_can_be_resumed(grbl: DriverGrbl, fault: int) -> None:
    moving(grbl)
    grbl.faults(1, fault)
    said = grbl.after(2.5)
    assert len(messages(said)) == 1
    assert grbl.state() == "Hold:0"
    grbl.faults(1, 0)
    assert grbl.after(1.0, "~") == ""
    assert grbl.state() == "Run"


@pytest.mark.parametrize(("action", "state"), [(0, "Run"), (1, "Hold:0")])
def test_the_setting_chooses_what_a_fault_does(kind: int, action: int, state: str) -> None:
    grbl = moving(make(kind, f"$746={action}"))
    grbl.faults(1, SHORT)
    said = grbl.after(1.0)
    assert len(messages(said)) == 1
    assert ALARM not in said
    assert grbl.state() == state


@pytest.mark.parametrize(
    ("fault", "text"),
    [
        (DEAF, "it does not take what is written"),
        (NO_SUPPLY, "no answer"),
        (UNWIRED, "no answer"),
    ],
)
def test_wrong_wiring_is_found_at_the_start_and_the_machine_does_not_move(kind: int, fault: int, text: str) -> None:
    grbl = DriverGrbl(kind)
    grbl.faults(0, fault)
    said = grbl.after(0.5)
    for ax in (2, 1, 0):
        said += grbl.after(0.02, f"${140 + ax}=700\n")
    said += grbl.after(1.5)
    told = [line for line in messages(said) if "is off" not in line]
    assert len(told) == 1
    assert told[0].startswith(f"[MSG:Driver X: {text}")
    said += grbl.after(1.0, "G91G1X5F300\n")
    assert ALARM in said
    assert grbl.position()[0] == 0
    assert grbl.rows()[1][3] == "ok"


def test_a_wire_that_returns_nothing_is_named() -> None:
    grbl = DriverGrbl(TMC2209)
    for ax in range(3):
        grbl.faults(ax, CUT)
    assert messages(grbl.after(1.5)) == [
        "[MSG:Driver X Y Z: nothing is received, not even what is sent. Check its UART wires, RX and TX]"
    ]


def test_noise_is_garbled_answers_not_silence() -> None:
    grbl = make(TMC2209)
    grbl.faults(2, NOISE)
    said = grbl.after(1.5)
    assert [line.split(".")[0] for line in messages(said)] == ["[MSG:Driver Z: garbled answers"]


def test_two_on_one_address_leave_the_other_address_silent() -> None:
    grbl = DriverGrbl(TMC2209)
    grbl.address(1, 0)
    said = grbl.after(1.5)
    assert messages(said) == ["[MSG:Driver Y: no answer. Check the motor supply, its bus wires and its address]"]


@WITHOUT_ESP32
def test_swapped_addresses_are_found_when_one_axis_moves(grbl: DriverGrbl) -> None:
    """Both answer and take every write; but the driver of X does not see the steps of X."""
    grbl.faults(0, CROSSED)
    said = grbl.after(3.0, "G91\nG1X200F1200\n")
    assert [line.split(".")[0] for line in messages(said)] == ["[MSG:Driver X: it does not see the steps of its axis"]
    assert ALARM in said


@pytest.mark.parametrize("mm_min", [1, 3, 4, 5, 20])
def test_a_slow_axis_is_not_taken_for_one_without_steps(mm_min: float) -> None:
    grbl = make(TMC2209)
    for _ in range(3):
        said = grbl.after(3.0, f"G91\nG1X{mm_min * 2 / 60}F{mm_min}\n")
        assert said == "ok\r\n" * 2, mm_min


def test_spi_drivers_without_a_current_say_that_they_are_off() -> None:
    grbl = DriverGrbl(TMC5160)
    assert "[MSG:Driver X Y Z: it is off until $140 .. sets its current]" in grbl.after(1.0)


@pytest.mark.parametrize("chained", [True, False])
def test_chained_chips_and_chips_with_their_own_select_get_their_own_values(chained: bool) -> None:
    grbl = make(TMC5160, "$140=600", "$141=1200", "$142=2400", chained=chained)
    irun = [grbl.register(ax, IHOLD_IRUN) >> 8 & 31 for ax in range(3)]
    assert irun == sorted(irun)
    assert irun[0] < irun[2]
    grbl.faults(1, NO_SUPPLY)
    assert "[MSG:Driver Y: no answer" in grbl.after(1.0)


def test_motion_waits_until_new_microsteps_are_in_the_driver(kind: int) -> None:
    grbl = make(kind)
    before = grbl.position()
    grbl.record()
    grbl.put("$150=32\nG91G1X1F600\n")
    while grbl.position() == before:
        grbl.after(0.0005)
    assert grbl.register(0, CHOPCONF) >> 24 & 15 == 3


def test_traffic_is_at_most_200_datagrams_a_second(kind: int) -> None:
    grbl = make(kind)
    before = grbl.datagrams()
    grbl.after(10.0)
    chips = 3 if kind != TMC2209 else 1  # every chip of a chain sees each of its transfers
    assert grbl.datagrams() - before <= 10 * 2 * 200 * chips


def test_settings_that_change_at_any_moment_are_never_taken_for_a_reset(kind: int) -> None:
    """Also while an answer to what was wanted before is on its way."""
    grbl = make(kind)
    for n in range(60):
        said = grbl.after(0.0137, f"$220={40 + n % 7}\n$150={8 << n % 2}\n")
        assert said.replace("ok\r\n", "") == "", said
    grbl.after(0.3)
    assert [row[-1] for row in grbl.rows()] == ["0"] * 3


@pytest.mark.parametrize("moves", [False, True])
def test_a_fault_in_a_parked_hold_is_an_alarm_in_its_time(moves: bool) -> None:
    """What has the same cause is waited for; the controller, and with it the simulator's time, continues meanwhile."""
    grbl = make(TMC2209)
    grbl.after(0.5, "M0\n")
    assert "Parked" in grbl.after(0.1, "\xa3")
    if moves:
        grbl.after(0.1, "$J=G91X30F600\n")
    grbl.faults(0, UNDERVOLTAGE)
    until = LIB.host_time_ticks(grbl._host) + 2 * HZ
    runs = Thread(target=LIB.host_run_until, args=(grbl._host, until), daemon=True)
    runs.start()
    runs.join(HANG_S)
    assert not runs.is_alive(), "the moment never ends"
    assert "ALARM:54" in grbl.heard() and grbl.state() == "Alarm"
