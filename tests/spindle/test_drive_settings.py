"""$395 and the settings of a drive: what is refused, and with which words."""

from __future__ import annotations

import pytest
from bus_grbl import BusGrbl, make_grbl
from drives import OwnRegisters, Yl620, make_drive
from grbl_host import Grbl
from wificnc.connection.words import ERRORS
from wificnc.tables import load_settings
from wificnc.tables.vfd import BAUDS, PARITIES, load_vfds

NO_BUS, UNKNOWN, LASER, IN_USE = 190, 191, 192, 193


def test_a_board_without_a_bus(grbl: Grbl) -> None:
    assert grbl.send("$395=5\n") == f"error:{NO_BUS}\r\n"
    assert grbl.send("$395=0\n") == "ok\r\n"
    assert "[spindle_bus]" in ERRORS[NO_BUS]


@pytest.fixture
def grbl() -> Grbl:  # type: ignore[misc]
    controller = Grbl()
    controller.send("")
    yield controller  # type: ignore[misc]
    controller.close()


def test_a_model_that_does_not_exist() -> None:
    grbl = make_grbl(Yl620(), "$395=5")
    for number in (len(load_vfds().vfd) + 1, 99, 255):
        assert grbl.after(0.05, f"$395={number}\n") == f"error:{UNKNOWN}\r\n"
    assert "docs/spindles.md" in ERRORS[UNKNOWN]
    grbl.close()


def test_no_laser_with_a_drive() -> None:
    grbl = make_grbl(Yl620(), "$395=5")
    assert grbl.after(0.05, "$32=1\n") == f"error:{LASER}\r\n"
    grbl.fine_soon("$395=0", "$32=1")
    assert grbl.after(0.05, "$395=5\n") == f"error:{LASER}\r\n"
    grbl.close()


@pytest.mark.parametrize("line", ["$395=0", "$395=2", "$460=3", "$374=3", "$375=100", "$461=30", "$471=2", "$681=1"])
def test_nothing_of_it_changes_while_the_spindle_is_on(line: str) -> None:
    grbl = make_grbl(Yl620(), "$395=5")
    grbl.after(0.3, "M3S5000\n")
    assert grbl.after(0.05, line + "\n") == f"error:{IN_USE}\r\n"
    grbl.after(0.3, "M5\n")
    grbl.fine_soon(line)
    grbl.close()


@pytest.mark.parametrize("line", ["$460=0", "$460=248", "$374=7", "$375=49", "$375=251", "$461=0", "$469=0", "$681=4"])
def test_ranges(line: str) -> None:
    grbl = make_grbl(Yl620(), "$395=5")
    assert grbl.after(0.05, line + "\n") == "error:2\r\n"
    grbl.close()


def test_the_numbers_are_grblhals() -> None:
    """What senders know of them; $374 and $681 as grblHAL's radio buttons."""
    numbers = {row.number: row.name for row in load_settings().setting}
    assert numbers[395] == "spindle_type" and numbers[460] == "vfd_address" and numbers[461] == "vfd_rpm_per_hz"
    assert numbers[374] == "vfd_baud" and numbers[375] == "vfd_timeout_ms" and numbers[681] == "vfd_parity"
    assert BAUDS == (2400, 4800, 9600, 19200, 38400, 115200) and PARITIES == ("none", "even", "odd")
    assert load_settings()["spindle_type"].max == len(load_vfds().vfd)


@pytest.mark.parametrize("value", range(6))
def test_baud_rates(value: int) -> None:
    grbl = make_grbl(Yl620(baud=BAUDS[value], delay_s=0.004), "$395=5", f"$374={value}")
    assert grbl.after(1.0, "M3S6000\n") == "ok\r\n"
    grbl.close()


@pytest.mark.parametrize("value", range(3))
def test_parities(value: int) -> None:
    grbl = make_grbl(Yl620(parity=value), "$395=5", f"$681={value}")
    assert grbl.after(1.0, "M3S6000\n") == "ok\r\n"
    grbl.close()


def test_address() -> None:
    grbl = make_grbl(Yl620(address=247), "$460=247", "$395=5")
    assert grbl.after(1.0, "M3S6000\n") == "ok\r\n"
    grbl.close()


def test_own_registers() -> None:
    """A drive with other numbers: GS20's, moved."""

    class Moved(OwnRegisters):
        def read(self, now_s: float, function: int, register: int) -> int | None:
            return round(abs(self.motor.hz(now_s)) * 60) if register == 0x3001 else None

        def write(self, now_s: float, function: int, register: int, value: int) -> bool:
            if register == 0x1100:
                self.run(now_s, {0x0111: 1, 0x0222: -1, 0x0555: 0}[value])
                return True
            if register == 0x1200:
                self.set_speed(now_s, value / 10)
                return True
            return False

    own = ("$462=4352", "$463=4608", "$464=12289", "$465=273", "$466=546", "$467=1365")
    drive = Moved()
    grbl = make_grbl(drive, *own, "$468=1", "$469=6", "$470=1", "$471=1", "$395=1")
    assert grbl.after(0.5, "M4S9000\n") == "ok\r\n"
    assert drive.motor.rpm(grbl.time()) == pytest.approx(-9000, abs=8)
    assert grbl.speeds()[1] == pytest.approx(9000, abs=8)
    grbl.after(0.3, "M5\n")
    assert drive.direction == 0
    grbl.close()


def test_own_registers_without_a_reading() -> None:
    """$464=65535: the run command is the poll."""
    drive = make_drive(1)[0]
    grbl = make_grbl(drive, "$464=65535", "$395=1")
    assert grbl.after(0.5, "M3S9000\n") == "ok\r\n"
    assert grbl.speeds()[1] is None
    assert not any(frame[1] == 3 for _, frame in drive.log)
    drive.silent = True
    assert "ALARM:53" in grbl.after(1.0)
    grbl.close()


def test_the_boards_own_outputs_stay_off() -> None:
    grbl = make_grbl(Yl620(), "$395=5")
    grbl.after(0.3, "M3S9000\n")
    assert grbl.outputs().spindle_direction == 0 and grbl.outputs().spindle_duty == 0
    grbl.after(0.3, "M5\n")
    grbl.fine_soon("$395=0")
    grbl.after(0.3, "M3S9000\n")
    assert grbl.outputs().spindle_direction == 1 and grbl.outputs().spindle_duty > 0
    grbl.close()


def test_a_board_with_a_bus_and_no_spindle_outputs() -> None:
    """M3 and M4 need a drive there."""
    grbl = BusGrbl(Yl620(), missing_outputs=7)
    grbl.after(0.01)
    assert grbl.after(0.05, "M3S100\n") == "error:135\r\n"
    grbl.fine_soon("$395=5")
    grbl.after(0.2)
    assert grbl.after(0.3, "M4S100\n") == "ok\r\n"
    grbl.close()


def test_the_virtual_machine_has_a_drive_of_each_model() -> None:
    """Without a slave: `wificnc sim` and `serve` simulate it."""
    for number in range(1, len(load_vfds().vfd) + 1):
        grbl = BusGrbl()
        grbl.detach()
        grbl.after(0.01)
        grbl.fine_soon("$30=24000", f"$395={number}", "$340=5")
        assert grbl.after(1.0, "M4S9000\n") == "ok\r\n", number
        assert grbl.spindle_rpm() == pytest.approx(-9000, rel=0.001), number
        assert grbl.speeds()[1] == pytest.approx(9000, rel=0.001), number
        assert grbl.after(0.5, "M5\n") == "ok\r\n" and grbl.spindle_rpm() == 0
        grbl.close()
