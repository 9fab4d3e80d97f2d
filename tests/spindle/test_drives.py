"""Each model of spindle drive against its slave, in virtual time: what it is commanded, and what is read of it."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from bus_grbl import FULL_RPM, BusGrbl, make_grbl
from drives import MODELS, Drive, make_drive

NUMBERS = sorted(MODELS)
HAS_LOAD = (2, 9)
CONFIRM_S = 0.15  # two commands at 9600 baud and their answers


@pytest.fixture(params=NUMBERS)
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


def test_it_is_commanded_to_stop_at_the_start(grbl: BusGrbl, drive: Drive) -> None:
    """Whatever it did while the controller started."""
    assert drive.commands() and drive.direction == 0
    assert len(set(drive.commands())) == 1


@pytest.mark.parametrize(("word", "direction"), [("M3", 1), ("M4", -1)])
@pytest.mark.parametrize("rpm", [600, 12000, FULL_RPM])
def test_direction_and_speed(grbl: BusGrbl, drive: Drive, word: str, direction: int, rpm: int) -> None:
    assert grbl.after(CONFIRM_S, f"{word}S{rpm}\n") == "ok\r\n"
    assert drive.direction == direction
    assert drive.motor.rpm(grbl.time()) == pytest.approx(direction * rpm, rel=0.001, abs=8)


def test_off(grbl: BusGrbl, drive: Drive) -> None:
    grbl.after(CONFIRM_S, "M3S9000\n")
    assert grbl.after(CONFIRM_S, "M5\n") == "ok\r\n"
    assert drive.direction == 0


def test_s_alone_changes_the_speed(grbl: BusGrbl, drive: Drive) -> None:
    grbl.after(CONFIRM_S, "M3S9000\n")
    assert grbl.after(CONFIRM_S, "S6000\n") == "ok\r\n"
    assert drive.motor.rpm(grbl.time()) == pytest.approx(6000, abs=8)


def test_override(grbl: BusGrbl, drive: Drive) -> None:
    grbl.after(CONFIRM_S, "M3S10000\n")
    grbl.after(CONFIRM_S, "\x9a")  # + 10 %
    assert drive.motor.rpm(grbl.time()) == pytest.approx(11000, abs=8)


def test_the_measured_speed_is_the_third_number_of_fs(grbl: BusGrbl, drive: Drive) -> None:
    """As grblHAL has it; of a spindle that is slower than commanded, where the drive measures that."""
    drive.motor.slip = 0.02
    grbl.after(0.5, "M3S10000\n")
    commanded, measured, _ = grbl.speeds()
    assert commanded == 10000
    shown = drive.motor.rpm(grbl.time()) if type(drive).__name__ == "H2a" else drive.motor.hz(grbl.time()) * 60
    shown = shown * 2 / drive.motor.poles if type(drive).__name__ != "H2a" else shown
    assert measured == pytest.approx(shown, abs=8)


def test_load(grbl: BusGrbl, number: int) -> None:
    grbl.after(1.0, "M3S10000\n")
    assert grbl.speeds()[2] == (2.4 if number in HAS_LOAD else None)


def test_a_move_begins_when_the_command_is_confirmed_and_not_before(grbl: BusGrbl, drive: Drive) -> None:
    drive.delay_s = 0.03
    grbl.put("G91\nM3S10000\nG1X5F600\n")
    before = grbl.position()
    while grbl.position() == before:
        grbl.after(0.001)
        assert grbl.time() < 2.0
    assert drive.direction == 1
    assert drive.motor.rpm(grbl.time()) == pytest.approx(10000, rel=0.001, abs=8)
    last = max(end_s for end_s, frame in drive.log if drive.is_command(frame[1:-2]))
    assert last + drive.delay_s < grbl.time() < last + drive.delay_s + 0.07


def test_ramp(grbl: BusGrbl, drive: Drive) -> None:
    """With $340 the feed begins when the drive has come to speed: here after 2 s."""
    drive.motor.ramp_hz_s = 100.0 * drive.motor.poles / 2
    grbl.fine_soon("$340=5", "G91")
    before, begin = grbl.position(), grbl.time()
    grbl.after(1.8, "M3S12000\nG1X5F600\n")
    assert grbl.position() == before
    while grbl.position() == before:
        grbl.after(0.005)
        assert grbl.time() < begin + 3
    assert drive.motor.rpm(grbl.time()) >= 0.95 * 12000


def test_it_is_polled_while_it_turns(grbl: BusGrbl, drive: Drive) -> None:
    """A lost bus must be noticed within 300 ms."""
    grbl.after(0.5, "M3S10000\n")
    drive.log.clear()
    grbl.after(1.0)
    assert 12 <= len(drive.log) <= 16


def test_frames_keep_their_distance(grbl: BusGrbl, drive: Drive) -> None:
    """3.5 characters of silence, from the end of an answer to the begin of the next request."""
    drive.log.clear()
    grbl.after(0.2, "M3S10000\n")
    char_s = (11 if drive.parity else 10) / drive.baud
    for (end_s, request), (next_end_s, after) in zip(drive.log, drive.log[1:], strict=False):
        answer_bytes = min(len(request), 5)
        begin_s = next_end_s - len(after) * char_s
        assert begin_s - (end_s + drive.delay_s + answer_bytes * char_s) >= 3.5 * char_s * 0.99
