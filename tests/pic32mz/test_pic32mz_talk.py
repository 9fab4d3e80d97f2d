"""The image at its serial port: boots, answers, keeps its settings."""

from __future__ import annotations

import pytest
from chip_controller import BANNER, Controller
from wificnc.board.model import Board
from wificnc.build.image import Block
from wificnc_chips.pic32mz import CPU_HZ

IRQ_CORE_TIMER = 0


def test_banner_within_20_ms_of_power_on(board: Board, image: tuple[Block, ...]) -> None:
    with Controller(board, image) as controller:
        assert controller.boot() == BANNER


def test_answers_what_grbl_answers(controller: Controller) -> None:
    assert controller.send("$I").startswith("[VER:1.1h")
    assert "$100=250.000\r\n" in controller.send("$$")
    assert controller.send("G1X1") == "error:22\r\n"
    report, start = controller.status().split("|Start:")
    assert report == "<Idle|MPos:0.000,0.000,0.000,0.000|FS:0,0|WCO:0.000,0.000,0.000,0.000"
    assert f"[START:{start.removesuffix('>')}]" in controller.send("$I")
    assert "Start" not in controller.status()


def test_baud_rate(controller: Controller) -> None:
    """115200 within 0.5 %: a byte lasts 10 bits."""
    begin = controller.chip.cycles
    controller.chip.write(b"?")
    while controller.chip.unread:
        controller.chip.run_until(controller.chip.cycles + 10)
    seconds = (controller.chip.cycles - begin) / CPU_HZ
    assert abs(seconds * 115200 / 10 - 1) < 0.006


def test_idle_processor_sleeps(controller: Controller) -> None:
    """At rest it does nothing but tick. Both ends of the second lie between two ticks, not on one."""
    controller.run(0.1)
    ticks = controller.chip.vector(IRQ_CORE_TIMER).count
    while controller.chip.vector(IRQ_CORE_TIMER).count == ticks:
        controller.run(0.0001)
    controller.run(0.0004)
    begin = controller.chip.instructions
    ticks = controller.chip.vector(IRQ_CORE_TIMER).count
    controller.run(1.0)
    assert controller.chip.vector(IRQ_CORE_TIMER).count - ticks == 1000
    assert controller.chip.instructions - begin < 0.02 * CPU_HZ


def test_no_step_interrupt_while_nothing_moves(controller: Controller) -> None:
    controller.fine("G91G0X1")
    controller.rest()
    controller.run(0.1)
    before = [controller.chip.vector(irq).count for irq in (7, 19)]
    controller.run(1.0)
    assert [controller.chip.vector(irq).count for irq in (7, 19)] == before


def test_settings_survive_a_power_cut(controller: Controller) -> None:
    controller.fine("$100=123.5", "G10L2P1X7Y8", "$N0=G20")
    controller.chip.power_on()
    assert controller.run(0.05).endswith(">G20:ok\r\n")
    assert "$100=123.500\r\n" in controller.send("$$")
    assert "[G54:7.000,8.000," in controller.send("$#")


def test_settings_go_back_to_defaults(controller: Controller) -> None:
    controller.fine("$100=123.5")
    controller.send("$RST=*")
    controller.chip.power_on()
    controller.boot()
    assert "$100=250.000\r\n" in controller.send("$$")


def test_many_changes_fill_a_page_and_the_other(controller: Controller) -> None:
    """Each one is kept, over several changes of the page in force."""
    for value in range(100, 200):
        controller.fine(f"$100={value}")
    controller.chip.power_on()
    controller.boot()
    assert "$100=199.000\r\n" in controller.send("$$")
    assert controller.chip.flash_operations > 2 * 1024


def test_soft_reset(controller: Controller) -> None:
    controller.fine("G91G1X100F3000")
    controller.run(0.5)
    said = controller.realtime("\x18", 1.0)
    assert "ALARM:3\r\n" in said and BANNER in said
    assert controller.send("$X") == "[MSG:Caution: Unlocked]\r\nok\r\n"
    at = controller.stands()[0]
    assert 0 < at < 25000 and controller.position()[0] == round(at / 250, 3)
    controller.fine("G90G0X0")
    controller.rest()
    assert controller.stands() == [0, 0, 0, 0]


@pytest.mark.slow
def test_watchdog_bites_a_program_that_hangs(controller: Controller) -> None:
    """The main loop is made an endless one, which waits for interrupts because that is quickly simulated: the chip
    restarts within 2.1 s, and says why."""
    cpu = controller.chip.cpu()
    hang = 0x80070000
    controller.chip.write_ram(
        hang & 0x1FFFFFFF, bytes.fromhex("20606041 20000042 fdff0010 00000000")
    )  # ei; wait; b .-8; nop
    cpu.pc, cpu.next_pc = hang, hang + 4
    controller.chip.set_cpu(cpu)
    controller.run(2.1)
    assert controller.chip.resets == 1
    assert "ALARM:56\r\n[MSG:Restarted by watchdog]" in controller.heard
