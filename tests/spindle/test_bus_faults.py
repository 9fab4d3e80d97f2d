"""What can be wrong with a bus: one message each, the spindle off, motion at rest, and nothing starts by itself."""

from __future__ import annotations

import random
from collections.abc import Iterator

import pytest
from bus_grbl import BusGrbl, make_grbl
from drives import Drive, Yl620, crc16, make_drive
from wificnc.simulator.library import Tasks

NOTICED_S = 0.3  # three polls
MOVE = "G91\nG1X200F1200\n"
ALARM = "ALARM:53"
QUIET_S = 0.6  # after an alarm
FEED_MM_S, STEPS_MM = 20.0, 250


@pytest.fixture(params=[2, 3, 5])
def number(request: pytest.FixtureRequest) -> int:
    return int(request.param)


@pytest.fixture
def drive(number: int) -> Drive:
    return make_drive(number)[0]


@pytest.fixture
def grbl(number: int, drive: Drive) -> Iterator[BusGrbl]:
    controller = make_grbl(drive, *make_drive(number)[1])
    yield controller
    controller.close()


@pytest.fixture
def runs(grbl: BusGrbl) -> BusGrbl:
    """A job is cutting."""
    assert grbl.after(1.0, "M3S10000\n" + MOVE) == "ok\r\n" * 3
    assert grbl.state() == "Run"
    return grbl


def start(drive: Drive, *settings: str) -> tuple[BusGrbl, str]:
    """A controller, and what it prints of a drive that cannot be reached."""
    grbl = BusGrbl(drive)
    grbl.after(0.01)
    for line in ("$395=5", *settings):
        grbl.after(0.02, line + "\n")
    return grbl, grbl.after(2.0)


def unlock(grbl: BusGrbl) -> None:
    """The way out of the alarm."""
    grbl.after(1.0, "\x18")
    assert grbl.after(0.1, "$X\n").endswith("ok\r\n")


# --- a bus that is lost in a job ---


def test_a_lost_bus_is_a_hold_then_an_alarm(runs: BusGrbl, drive: Drive) -> None:
    """FluidNC issue 910: the axes continued with a drive that was off."""
    drive.silent = True
    said, took = runs.until("[MSG:", NOTICED_S)
    assert took <= NOTICED_S and runs.state().startswith("Hold")
    said += runs.until(ALARM, 2.0)[0]
    assert said.count("[MSG:") == 1 and "no answer" in said
    position = runs.position()
    runs.after(1.0)
    assert runs.position() == position == runs.stands()
    assert runs.state() == "Alarm"


def test_nothing_is_lost_by_the_hold(runs: BusGrbl, drive: Drive) -> None:
    """The axes slow down: the position stays trusted, as far as it was."""
    drive.silent = True
    runs.until(ALARM, 2.0)
    runs.after(QUIET_S)
    unlock(runs)
    assert "ALARM" not in runs.after(0.2, "G91G1X1F600\n")
    assert runs.position() == runs.stands()


def test_a_drive_that_comes_back_is_stopped(runs: BusGrbl, drive: Drive) -> None:
    drive.silent = True
    runs.until(ALARM, 2.0)
    assert drive.direction == 1  # it did not hear the stop
    drive.silent = False
    said = runs.after(1.0)
    assert drive.direction == 0
    assert "answers again: stopped" in said


def test_nothing_starts_by_itself_after_the_alarm(runs: BusGrbl, drive: Drive) -> None:
    drive.silent = True
    runs.until(ALARM, 2.0)
    drive.silent = False
    position = runs.position()
    runs.after(1.0, "~")
    runs.after(1.0, "\x18")
    runs.after(5.0, "~\n")
    assert drive.direction == 0 and runs.position() == position


def test_it_works_again_after_a_reset(runs: BusGrbl, drive: Drive) -> None:
    drive.silent = True
    runs.until(ALARM, 2.0)
    drive.silent = False
    runs.after(QUIET_S)
    unlock(runs)
    assert runs.after(0.3, "M3S8000\n") == "ok\r\n"
    assert drive.direction == 1


def test_resume_does_not_end_the_hold(runs: BusGrbl, drive: Drive) -> None:
    drive.silent = True
    while runs.state() == "Run":
        runs.after(0.001)
    runs.after(0.005, "~")
    said, took = runs.until(ALARM, 2.0)
    assert took < 0.5 and "ok" not in said
    runs.after(QUIET_S)
    assert runs.state() == "Alarm"


def test_m53_does_not_keep_the_axes_going(grbl: BusGrbl, drive: Drive) -> None:
    grbl.after(1.0, "M3S10000\nM53P0\n" + MOVE)
    drive.silent = True
    grbl.until(ALARM, 2.0)
    grbl.after(QUIET_S)
    assert grbl.state() == "Alarm"


@pytest.mark.parametrize("lost", [1, 2])
def test_single_lost_answers_do_no_harm(runs: BusGrbl, drive: Drive, lost: int) -> None:
    for _ in range(10):
        drive.dropped = lost
        assert runs.after(0.4) == ""
    assert runs.state() == "Run" and drive.direction == 1


def test_single_crc_errors_do_no_harm(runs: BusGrbl, drive: Drive) -> None:
    rng = random.Random(46)
    for _ in range(20):
        drive.damaged = rng.randint(1, 2)
        assert runs.after(0.3) == ""
    assert runs.state() == "Run"


def test_an_unterminated_bus(runs: BusGrbl, drive: Drive) -> None:
    """Every answer has CRC errors."""
    drive.damaged = -1
    said, took = runs.until(ALARM, 2.0)
    assert "garbled" in said and "ermination" in said
    assert took < NOTICED_S + 0.5


def test_answers_that_come_one_request_late(runs: BusGrbl, drive: Drive) -> None:
    """None of them is taken for the newest request's: the drive is lost, not misunderstood."""
    drive.late_by_one = True
    said, _ = runs.until(ALARM, 2.0)
    assert said.count("[MSG:") == 1


def test_a_late_start_does_not_confirm_a_stop(drive: Drive, grbl: BusGrbl) -> None:
    """The answer to M3 comes after the time-out, when M5 was sent: the stop is not confirmed by it."""
    grbl.after(0.5, "M3S10000\n")
    drive.late_by_one = True
    grbl.put("M5\n")
    said, _ = grbl.until(ALARM, 3.0)
    assert "ok" not in said.split(ALARM)[0]


def test_slow_answers_are_waited_for_by_375(number: int) -> None:
    drive, settings = make_drive(number)
    drive.delay_s = 0.15
    grbl = BusGrbl(drive)
    grbl.after(0.01)
    said = grbl.after(0.05, "$375=200\n") + grbl.after(2.0, f"{settings[0]}\n")
    assert "MSG" not in said
    assert grbl.after(2.0, "M3S6000\n") == "ok\r\n"
    grbl.close()


def test_noise_between_frames(runs: BusGrbl, drive: Drive) -> None:
    rng = random.Random(3)
    for _ in range(40):
        runs.put_on_bus(runs.time(), rng.randbytes(rng.randint(1, 8)))
        assert runs.after(0.05) == ""
    assert runs.state() == "Run"


def test_endless_noise(runs: BusGrbl) -> None:
    rng = random.Random(5)
    said = ""
    for _ in range(60):
        runs.put_on_bus(runs.time(), rng.randbytes(40))
        said += runs.after(0.03)
    assert ALARM in said and "garbled" in said


# --- a drive that cannot be reached at the start ---


def test_silence_at_the_start_is_one_message_and_no_alarm() -> None:
    grbl, said = start(Yl620(silent=True))
    assert said.count("[MSG:") == 1 and "no answer" in said and "ALARM" not in said
    assert grbl.state() == "Idle"
    grbl.close()


@pytest.mark.parametrize("wrong", ["$460=2", "$374=3", "$681=1"])
def test_a_wrong_address_or_format(wrong: str) -> None:
    grbl, said = start(Yl620(), wrong)
    assert said.count("[MSG:") == 1 and "$460" in said and "$374" in said
    grbl.after(0.2, {"$460": "$460=1\n", "$374": "$374=2\n", "$681": "$681=0\n"}[wrong[:4]])
    assert grbl.after(0.5, "M3S6000\n") == "ok\r\n"
    grbl.close()


def test_two_drives_with_one_address() -> None:
    """Their answers overlap."""
    first, second = Yl620(), Yl620()
    second.delay_s = 0.0023
    second.motor.slip = 0.5
    grbl = BusGrbl(first, second)
    grbl.after(0.01)
    said = grbl.after(0.02, "$395=5\n") + grbl.after(2.0)
    assert said.count("[MSG:") == 1 and "two devices" in said
    grbl.close()


def test_another_model() -> None:
    """It refuses registers that it does not have."""
    grbl = BusGrbl(make_drive(7)[0])
    grbl.after(0.01)
    said = grbl.after(0.02, "$395=5\n") + grbl.after(2.0)
    assert said.count("[MSG:") == 1 and "refuses" in said and "$395" in said
    grbl.close()


@pytest.mark.parametrize("number", [2, 3, 5, 6])
def test_a_bus_that_returns_what_is_sent(number: int) -> None:
    """Without a drive: the echo of a command looks like its confirmation."""
    drive, settings = make_drive(number)
    drive.echoes, drive.silent = True, True
    grbl = BusGrbl(drive)
    grbl.after(0.01)
    said = "".join(grbl.after(0.02, f"{line}\n") for line in settings) + grbl.after(2.0)
    assert said.count("[MSG:") == 1 and "RE" in said
    said = grbl.after(1.0, "M3S6000\nG91G1X5F600\n")
    assert ALARM in said and "ok" not in said
    assert grbl.position()[0] == 0
    grbl.close()


def test_a_start_with_a_dead_drive_moves_nothing() -> None:
    grbl, _ = start(Yl620(silent=True))
    said = grbl.after(2.0, "M3S6000\nG91G1X5F600\n")
    assert ALARM in said and "ok" not in said.split(ALARM)[0]
    assert grbl.position()[0] == 0
    grbl.close()


# --- a spindle that does not do what it is commanded ---


def test_a_spindle_at_a_fifth_of_its_speed_is_waited_for(grbl: BusGrbl, drive: Drive) -> None:
    """FluidNC issue 1666: the feed began at 20 %."""
    grbl.fine_soon("$340=5", "G91")
    drive.motor.ramp_hz_s = 200.0 * drive.motor.poles / 2
    grbl.put("M3S20000\nG1X5F600\n")
    while grbl.position()[0] == 0:
        grbl.after(0.005)
    assert drive.motor.rpm(grbl.time()) >= 0.95 * 20000


def test_a_spindle_that_never_comes_to_speed() -> None:
    """Overloaded, or a current limit."""
    drive = Yl620(maximum_hz=100.0)
    grbl = make_grbl(drive, "$395=5", "$340=10")
    grbl.put("M3S20000\nG91G1X5F600\n")
    said, _ = grbl.until("ALARM:51", 12.0, 0.05)
    assert "Spindle not at speed: 6000 rpm measured, 20000 rpm commanded" in said
    assert grbl.position()[0] == 0
    grbl.after(0.3)
    assert drive.direction == 0
    grbl.close()


def test_a_motor_with_other_poles() -> None:
    """4 poles, and $461 says 2: a drive that reports rpm shows it."""
    drive, settings = make_drive(3)
    drive.motor.poles = 4
    grbl = make_grbl(drive, *settings, "$340=10")
    grbl.put("M3S20000\nG91G1X5F600\n")
    said, _ = grbl.until("ALARM:51", 12.0, 0.05)
    assert "10000 rpm measured" in said
    grbl.close()


@pytest.mark.parametrize(("poles", "per_hz"), [(2, 60), (4, 30), (6, 20)])
def test_461_is_the_motor(poles: int, per_hz: int) -> None:
    drive = Yl620(maximum_hz=1200.0)
    drive.motor.poles = poles
    grbl = make_grbl(drive, "$395=5", f"$461={per_hz}")
    grbl.after(0.5, "M3S18000\n")
    assert drive.motor.rpm(grbl.time()) == pytest.approx(18000, abs=8)
    assert grbl.speeds()[1] == pytest.approx(18000, abs=8)
    grbl.close()


# --- the firmware's own lateness ---


@pytest.mark.parametrize("tasks", [Tasks.ESP32, Tasks.PIC32MZ])
def test_in_the_periods_of_the_firmware(number: int, tasks: Tasks) -> None:
    drive, settings = make_drive(number)
    grbl = make_grbl(drive, *settings, tasks=tasks)
    assert grbl.after(1.0, "M3S10000\n" + MOVE) == "ok\r\n" * 3
    drive.silent = True
    begin = grbl.time()
    while grbl.state() == "Run":
        grbl.after(0.005)
    assert grbl.time() - begin <= NOTICED_S + 0.02
    grbl.until(ALARM, 2.0)
    grbl.close()


def test_a_stalled_controller_takes_answers_that_came_meanwhile(runs: BusGrbl) -> None:
    """It looks late, but they were there in time."""
    import stalls

    for _ in range(20):
        runs.stall(stalls.Side.CONTROLLER, after_s=0.01, for_s=0.3)
        assert ALARM not in runs.after(0.4)
    assert runs.speeds()[1] == pytest.approx(10000, abs=8)


def test_crc_of_the_standard() -> None:
    """An example that Modbus' own guide has: 02 07 is followed by 41 12."""
    assert crc16(bytes([0x02, 0x07])) == bytes([0x41, 0x12])
