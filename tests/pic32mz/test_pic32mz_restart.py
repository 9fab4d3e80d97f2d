"""What a restart reports, and what it locks: each cause that the chip knows, in motion and at rest."""

from __future__ import annotations

import pytest
from chip_controller import BANNER, Controller
from wificnc_chips.pic32mz import pin_number

CODE = 0x80070000  # RAM that the program does not use
PWM_PIN = pin_number("RE3")
BOR, WDTO, DMTO, SWR, EXTR = 1 << 1, 1 << 4, 1 << 5, 1 << 6, 1 << 7

# Instructions, cause in words. Each begins with `nop`, so that the address is the second word's.
FAULTS = {
    "lw v0, 1(zero)": ("0100028c", "address error on load"),
    "sw v0, 2(zero)": ("020002ac", "address error on store"),
    "lw v0, 0(zero): a NULL pointer": ("0000028c", "no memory at this address"),
    "sw v0, 8(zero): a member of NULL": ("080002ac", "no memory at this address"),
    "jr zero: a function that is NULL": ("08000000", "no memory at this address"),
    "break": ("0d000000", "breakpoint"),
}


def moving(controller: Controller) -> None:
    controller.fine("$22=0", "G91G1X180F5000")
    controller.run(0.5)
    assert controller.realtime("?").startswith("<Run")


def locked(controller: Controller, cause: str) -> None:
    """It says so, moves nothing until $X, and then is as ever."""
    said = controller.run(0.3)
    assert f"{BANNER}ALARM:56\r\n[MSG:Restarted by {cause}]\r\n" in said
    before = controller.stands()
    assert "error:9\r\n" in controller.send("G1X185F1000")
    assert controller.realtime("?").startswith("<Alarm") and controller.stands() == before
    assert f"[RESTART:{cause}]" in controller.send("$I")
    assert controller.send("$X").endswith("ok\r\n")
    controller.fine("G91G1X1F1000")


@pytest.mark.parametrize("what", FAULTS)
def test_a_fault_in_motion_locks(controller: Controller, what: str) -> None:
    code, cause = FAULTS[what]
    moving(controller)
    cpu = controller.chip.cpu()
    controller.chip.write_ram(CODE & 0x1FFFFFFF, bytes.fromhex("00000000" + code + "0000000000000000"))
    cpu.pc, cpu.next_pc, cpu.r[31] = CODE, CODE + 4, 0x9D001234
    controller.chip.set_cpu(cpu)
    at = 0 if what.startswith("jr") else CODE + 4
    locked(controller, f"fault at 0x{at:08X} 0x9D001234 ({cause})")
    assert controller.chip.resets == 1


@pytest.mark.parametrize(("bits", "cause"), [(WDTO, "watchdog"), (DMTO, "watchdog"), (BOR, "brown-out")])
@pytest.mark.parametrize("moves", [True, False])
def test_a_reset_of_the_chip_locks(controller: Controller, bits: int, cause: str, moves: bool) -> None:
    if moves:
        moving(controller)
    controller.chip.reset_by(bits)
    locked(controller, cause)


@pytest.mark.parametrize(("bits", "cause"), [(EXTR, "reset in motion"), (SWR, "unknown cause"), (0, "unknown cause")])
def test_a_reset_from_outside_locks_in_motion_alone(controller: Controller, bits: int, cause: str) -> None:
    """At rest the reset button, a bootloader and a debugger are a start as any other."""
    controller.chip.reset_by(bits)
    assert "ALARM" not in controller.run(0.1)
    moving(controller)
    controller.chip.reset_by(bits)
    locked(controller, cause)


def test_power_on_is_no_restart(controller: Controller) -> None:
    """Even in motion, and with RAM that kept its contents."""
    moving(controller)
    controller.chip.power_on()
    assert controller.run(0.1).endswith(BANNER)


def test_a_lost_oscillator(controller: Controller) -> None:
    """Outputs off, readable at 8 MHz, tried again each second; when it works again the machine is locked."""
    controller.fine("M3S1000")
    moving(controller)
    controller.chip.record_edges(True)
    began = controller.chip.cycles
    controller.chip.oscillator(False)
    second = 8_000_000  # cycles of the backup clock
    controller.chip.run_until(began + second // 2)
    assert "[MSG:Lost oscillator: " in controller.chip.read().decode("latin-1")
    assert controller.chip.level(PWM_PIN) == 0 and controller.chip.resets == 0
    stood = controller.stands()
    controller.chip.run_until(began + 3 * second)
    assert controller.chip.read().count(b"[MSG:Lost oscillator: ") == 2
    assert controller.chip.resets == 2 and controller.stands() == stood
    controller.chip.oscillator(True)
    controller.chip.run_until(controller.chip.cycles + 3 * second)
    said = controller.chip.read().decode("latin-1")
    assert "ALARM:56\r\n[MSG:Restarted by lost oscillator]" in said
