"""A test for each sentence of the data sheet (DS60001320) that the firmware relies on."""

from __future__ import annotations

import struct

import pytest
from wificnc_chips.fault import ChipFault
from wificnc_chips.pic32mz.chip import CPU_HZ, Cpu, Stop, VirtualChip, pin_number

CLR, SET, INV = 4, 8, 12
SYSKEY, CFGCON, RSWRST, PB2DIV, PB3DIV, WDTCON = 0xBF800030, 0xBF800000, 0xBF801250, 0xBF801310, 0xBF801320, 0xBF800800
NVMCON, NVMKEY, NVMADDR, NVMDATA = 0xBF800600, 0xBF800610, 0xBF800620, 0xBF800630
T4CON, TMR4, PR4, OC1CON, OC1R, OC1RS = 0xBF840600, 0xBF840610, 0xBF840620, 0xBF844000, 0xBF844010, 0xBF844020
U2MODE, U2STA, U2TX, U2BRG = 0xBF822200, 0xBF822210, 0xBF822220, 0xBF822240
U3MODE, U3STA, U3TX, U3RX, U3BRG = 0xBF822400, 0xBF822410, 0xBF822420, 0xBF822430, 0xBF822440
IRQ_OC1, IRQ_T4, IRQ_CN_D, IRQ_U3_RX, IRQ_U3_TX = 7, 19, 121, 158, 159
IRQ_U2_TX = 147
RPD5R = 0xBF8015D4
OSCCON, RCON, RNMICON = 0xBF801200, 0xBF801240, 0xBF801260
POR, BOR, WDTO, EXTR = 1 << 0, 1 << 1, 1 << 4, 1 << 7
CLOCK_FAILS = 1 << 17
PLL_CLOCK, BACKUP_CLOCK = 1, 6  # OSCCON.COSC
ON = 1 << 15
SPIN = 0x1000FFFF  # b .
WAIT, SPIN_BACK = 0x42000020, 0x1000FFFE  # b .-4
TICK = 4  # cycles of PBCLK3 at a divider of 4

CODE = 0x80001000


def port(letter: str, offset: int) -> int:
    return 0xBF860000 + 0x100 * (ord(letter) - ord("A")) + offset


def flag(chip: VirtualChip, irq: int) -> int:
    return chip.read_register(0xBF810040 + 0x10 * (irq // 32)) >> irq % 32 & 1


def clear(chip: VirtualChip, irq: int) -> None:
    chip.write_register(0xBF810040 + 0x10 * (irq // 32) + CLR, 1 << irq % 32)


def spin(chip: VirtualChip) -> None:
    """The CPU does nothing, interrupts are off."""
    chip.write_ram(CODE & 0x1FFFFFFF, struct.pack("<2I", SPIN, 0))
    chip.set_cpu(Cpu(pc=CODE, next_pc=CODE + 4))


def unlock(chip: VirtualChip) -> None:
    for value in (0, 0xAA996655, 0x556699AA):
        chip.write_register(SYSKEY, value)


@pytest.fixture
def ready(chip: VirtualChip) -> VirtualChip:
    """Spinning, timers and UART at a quarter of the CPU's clock, OC1 on timer 4."""
    spin(chip)
    unlock(chip)
    chip.write_register(PB2DIV, ON | 3)
    chip.write_register(PB3DIV, ON | 3)
    chip.write_register(CFGCON + SET, 1 << 16)
    chip.write_register(SYSKEY, 0)
    return chip


def pulses(chip: VirtualChip, period: int, rise: int, fall: int) -> None:
    """OC1 in continuous pulses on timer 4; starts now."""
    chip.write_register(PR4, period)
    chip.write_register(OC1R, rise)
    chip.write_register(OC1RS, fall)
    chip.write_register(OC1CON, ON | 5)
    chip.write_register(T4CON, ON)


# ---- registers ----


def test_set_clear_invert(ready: VirtualChip) -> None:
    lat = port("D", 0x30)
    for how, value, wanted in (
        (0, 0x00F0, 0x00F0),
        (SET, 0x0F01, 0x0FF1),
        (CLR, 0x0010, 0x0FE1),
        (INV, 0x0003, 0x0FE2),
    ):
        ready.write_register(lat + how, value)
        assert ready.read_register(lat) == wanted


@pytest.mark.parametrize(
    ("address", "said"),
    [
        (0xBF80FFF0, "unknown register bf80fff0"),
        (0xBF860738, "unknown register"),
        (0x9D000000, "cannot be stored to"),
        (0x40000000, "the TLB was never written"),
        (0xBE000000, "cannot be stored to"),
    ],
)
def test_what_is_not_there_stops_the_chip(ready: VirtualChip, address: int, said: str) -> None:
    ready.write_register(address, 1)
    assert said in ready.fault


def test_registers_that_are_locked(ready: VirtualChip) -> None:
    """12.2 and 34: CFGCON wants the two keys of SYSKEY in order, with nothing between them."""
    ready.write_register(SYSKEY, 0xAA996655)
    ready.write_register(SYSKEY, 0)
    ready.write_register(SYSKEY, 0x556699AA)
    ready.write_register(CFGCON, 0)
    assert "CFGCON while SYSKEY locks it" in ready.fault


def test_software_reset_comes_with_the_read(ready: VirtualChip) -> None:
    """Register 6-2: SWRST is carried out by a read of RSWRST."""
    unlock(ready)
    ready.write_register(RSWRST + SET, 1)
    assert ready.resets == 0
    ready.read_register(RSWRST)
    assert ready.resets == 1 and ready.cpu().pc == 0xBFC00000


def test_causes_of_resets_stay_until_they_are_cleared(ready: VirtualChip) -> None:
    """Register 6-1; a power-on begins with its own."""
    ready.write_register(RCON, 0)
    for cause in (EXTR, WDTO):
        ready.reset_by(cause)
    assert ready.read_register(RCON) == EXTR | WDTO
    ready.power_on()
    assert ready.read_register(RCON) == POR | BOR


def test_a_lost_oscillator_is_no_reset(ready: VirtualChip) -> None:
    """Section 8.2: the clock monitor goes over to the backup clock and raises an NMI, at the address of a reset. Ports
    and RAM stay; a reset does not bring the clock back."""
    ready.write_register(port("D", 0x30), 0x00F0)
    ready.write_ram(0x100, b"here")
    ready.oscillator(False)
    assert ready.cpu().pc == 0xBFC00000 and ready.resets == 0
    assert ready.read_register(RNMICON) == CLOCK_FAILS
    assert ready.read_register(OSCCON) >> 12 & 7 == BACKUP_CLOCK
    assert ready.read_register(port("D", 0x30)) == 0x00F0 and ready.read_ram(0x100, 4) == b"here"
    ready.reset_by(EXTR)
    assert ready.read_register(OSCCON) >> 12 & 7 == BACKUP_CLOCK and ready.read_register(port("D", 0x30)) == 0
    ready.oscillator(True)
    ready.reset_by(EXTR)
    assert ready.read_register(OSCCON) >> 12 & 7 == PLL_CLOCK


@pytest.mark.slow
def test_watchdog(ready: VirtualChip) -> None:
    """It bites 2.048 s after it was last cleared by 0x5743 in its upper half; a CPU that waits costs no time here."""
    ready.write_ram(CODE & 0x1FFFFFFF, struct.pack("<3I", WAIT, SPIN_BACK, 0))
    ready.set_cpu(Cpu(pc=CODE, next_pc=CODE + 4))
    ready.write_register(WDTCON + SET, ON)
    ready.run(1.5)
    ready.write_register(WDTCON, 0x57430000 | ON)
    ready.run(2.0)
    assert ready.resets == 0
    with pytest.raises(ChipFault, match="instruction ffffffff at bfc0000"):  # there is no program to start again
        ready.run(0.1)
    assert ready.resets == 1


# ---- timer and output compare ----


def test_a_timer_counts_to_its_period_and_one_further_to_zero(ready: VirtualChip) -> None:
    """14: TMR = PR, then 0: the interrupt comes every PR + 1 ticks."""
    ready.write_register(PR4, 99)
    ready.write_register(T4CON, ON)
    begin = ready.cycles
    for period in range(1, 5):
        ready.run_until(begin + period * 100 * TICK - 1)
        assert flag(ready, IRQ_T4) == 0
        ready.run_until(begin + period * 100 * TICK + 1)
        assert flag(ready, IRQ_T4) == 1
        clear(ready, IRQ_T4)


def test_a_timer_can_be_read_and_written_while_it_runs(ready: VirtualChip) -> None:
    ready.write_register(T4CON, ON)
    begin = ready.cycles
    ready.run_until(begin + 1000 * TICK)
    assert ready.read_register(TMR4) == 1000
    ready.write_register(TMR4, 65530)
    ready.run_until(ready.cycles + 6 * TICK + 1)
    assert flag(ready, IRQ_T4) == 1 and ready.read_register(TMR4) == 0


def test_a_period_below_the_count_is_met_the_next_time_round(ready: VirtualChip) -> None:
    """14: the match is for equality; a count beyond PR continues to FFFF, and falls to 0 without an interrupt."""
    ready.write_register(T4CON, ON)
    begin = ready.cycles
    ready.run_until(begin + 500 * TICK)
    ready.write_register(PR4, 400)
    ready.run_until(begin + 65536 * TICK + 1)
    assert flag(ready, IRQ_T4) == 0 and ready.read_register(TMR4) == 0
    ready.run_until(begin + (65536 + 401) * TICK + 1)
    assert flag(ready, IRQ_T4) == 1


@pytest.mark.parametrize(("code", "divider"), [(0, 1), (3, 8), (7, 256)])
def test_prescaler(ready: VirtualChip, code: int, divider: int) -> None:
    ready.write_register(T4CON, ON | code << 4)
    begin = ready.cycles
    ready.run_until(begin + 100 * divider * TICK)
    assert ready.read_register(TMR4) == 100


def test_a_faster_cpu_leaves_the_timers_alone(ready: VirtualChip) -> None:
    """No chip has it: four times the instructions in a tick of the same timer, and in one of CP0 Count."""
    ready.cpu_speed(4)
    ready.write_register(PR4, 0xFFFF)
    ready.write_register(T4CON, ON)
    begin, spun = ready.cycles, ready.instructions
    ready.run(1e-6)
    assert ready.read_register(TMR4) == 50 and ready.cycles - begin == ready.instructions - spun == 4 * 200


def test_continuous_pulses(ready: VirtualChip) -> None:
    """16.3.2.4: OC rises where the timer equals OCxR, falls where it equals OCxRS, and there the interrupt comes."""
    ready.write_register(RPD5R, 12)
    ready.write_register(port("D", 0x10) + CLR, 1 << 5)
    ready.record_edges(True)
    begin = ready.cycles
    pulses(ready, period=99, rise=10, fall=35)
    ready.run_until(begin + 35 * TICK - 1)
    assert flag(ready, IRQ_OC1) == 0
    ready.run_until(begin + 250 * TICK)
    assert flag(ready, IRQ_OC1) == 1
    pin = pin_number("RD5")
    wanted = [(begin + (n * 100 + at) * TICK, pin, level) for n in range(2) for at, level in ((10, 1), (35, 0))]
    assert ready.edges()[:4] == wanted


def test_a_register_written_at_the_very_moment_of_a_compare_loses_nothing(ready: VirtualChip) -> None:
    """What is due happens before the access, however long the instruction has taken."""
    begin = ready.cycles
    pulses(ready, period=99, rise=10, fall=35)
    ready.run_until(begin + 35 * TICK)
    ready.write_register(PR4, 120)
    assert flag(ready, IRQ_OC1) == 1


def test_output_compare_1_is_on_timer_2_without_ocaclk(ready: VirtualChip) -> None:
    """Table 18-1: timer 4 drives OC1 only while CFGCON.OCACLK is set."""
    unlock(ready)
    ready.write_register(CFGCON + CLR, 1 << 16)
    pulses(ready, period=99, rise=10, fall=35)
    ready.run(0.001)
    assert flag(ready, IRQ_T4) == 1 and flag(ready, IRQ_OC1) == 0


def test_a_pulse_end_behind_the_period_never_comes(ready: VirtualChip) -> None:
    """16.3.2.6: OCxRS > PR: no falling edge, no interrupt."""
    pulses(ready, period=99, rise=10, fall=100)
    ready.run(0.001)
    assert flag(ready, IRQ_OC1) == 0


# ---- UART ----


def start_uart(chip: VirtualChip, select: int = 2) -> None:
    chip.write_register(U3BRG, 108)
    chip.write_register(U3STA, select << 14 | 1 << 12 | 1 << 10)
    chip.write_register(U3MODE, ON | 8)


def test_bytes_take_their_time(ready: VirtualChip) -> None:
    """22: 10 bits of 4 (BRG + 1) clocks with BRGH."""
    start_uart(ready)
    begin = ready.cycles
    for byte in b"ab":
        ready.write_register(U3TX, byte)
    ready.run_until(begin + 2 * 10 * 4 * 109 * 4 - 1)
    assert ready.read() == b"a"
    ready.run_until(begin + 2 * 10 * 4 * 109 * 4 + 1)
    assert ready.read() == b"b"


def test_receive_interrupt_is_persistent(ready: VirtualChip) -> None:
    """7: its flag comes back as long as a byte waits."""
    start_uart(ready)
    ready.write(b"xy")
    ready.run(0.001)
    clear(ready, IRQ_U3_RX)
    ready.run(0.00001)
    assert flag(ready, IRQ_U3_RX) == 1
    assert [ready.read_register(U3RX) for _ in range(2)] == list(b"xy")
    clear(ready, IRQ_U3_RX)
    ready.run(0.00001)
    assert flag(ready, IRQ_U3_RX) == 0


# ---- UART 2, the bus of a spindle drive ----

DE = pin_number("RG7")
TRIS_G, LAT_G = 0xBF860610, 0xBF860630


def start_bus(chip: VirtualChip, parity: int = 0, de: int = 1) -> None:
    """9600 baud at 50 MHz; DE at this level."""
    chip.write_register(TRIS_G + CLR, 1 << DE % 16)
    chip.write_register(LAT_G, de << DE % 16)
    chip.write_register(U2BRG, 325)
    chip.write_register(U2STA, 1 << 14 | 1 << 12 | 1 << 10)
    chip.write_register(U2MODE, ON | parity << 1)
    chip.bus_driver(DE)


@pytest.mark.parametrize(("parity", "bits"), [(0, 10), (1, 11), (2, 11)])
def test_a_byte_of_the_bus_takes_its_time(ready: VirtualChip, parity: int, bits: int) -> None:
    """22: 16 (BRG + 1) clocks a bit without BRGH; the interrupt of UTXISEL = 1 comes after the stop bit."""
    start_bus(ready, parity)
    begin, cycles = ready.cycles, bits * 16 * 326 * 4
    ready.write_register(U2TX, ord("a"))
    clear(ready, IRQ_U2_TX)
    ready.run_until(begin + cycles - 100)
    assert ready.bus_read() == b"" and flag(ready, IRQ_U2_TX) == 0
    ready.run_until(begin + cycles + 100)
    assert ready.bus_read() == b"a" and flag(ready, IRQ_U2_TX) == 1
    assert ready.bus_byte_s() == pytest.approx(bits / 9600, rel=0.002)


def test_a_byte_that_is_sent_without_de_is_a_fault(ready: VirtualChip) -> None:
    start_bus(ready, de=0)
    ready.write_register(U2TX, ord("a"))
    with pytest.raises(ChipFault, match="while DE is low"):
        ready.run(0.002)


def test_de_that_falls_before_the_stop_bit_is_a_fault(ready: VirtualChip) -> None:
    start_bus(ready)
    ready.write_register(U2TX, ord("a"))
    ready.run(0.0009)
    ready.write_register(LAT_G, 0)
    with pytest.raises(ChipFault, match="while DE is low"):
        ready.run(0.001)


def test_an_answer_into_de_is_a_fault(ready: VirtualChip) -> None:
    start_bus(ready)
    ready.bus_write(b"a")
    with pytest.raises(ChipFault, match="while DE is high"):
        ready.run(0.002)


def test_a_ninth_byte_overruns(ready: VirtualChip) -> None:
    """22: OERR; the eight in the FIFO stay, clearing OERR empties it."""
    start_uart(ready)
    ready.write(b"123456789")
    ready.run(0.01)
    assert ready.read_register(U3STA) & 3 == 3
    assert ready.read_register(U3RX) == ord("1")
    ready.write_register(U3STA + CLR, 2)
    assert ready.read_register(U3STA) & 3 == 0


def test_a_framing_error_belongs_to_the_byte_that_is_read_next(ready: VirtualChip) -> None:
    """22: FERR."""
    start_uart(ready)
    ready.write(b"1")
    ready.write_unframed(b"2")
    ready.write(b"3")
    ready.run(0.01)
    found = [(ready.read_register(U3STA) >> 2 & 1, ready.read_register(U3RX)) for _ in range(3)]
    assert found == [(0, ord("1")), (1, ord("2")), (0, ord("3"))]
    assert ready.read_register(U3STA) & 7 == 0


def test_transmit_interrupt_while_the_fifo_is_empty(ready: VirtualChip) -> None:
    start_uart(ready, select=2)
    ready.run(0.00001)
    assert flag(ready, IRQ_U3_TX) == 1
    for byte in b"abc":
        ready.write_register(U3TX, byte)
    clear(ready, IRQ_U3_TX)
    ready.run(0.00001)
    assert flag(ready, IRQ_U3_TX) == 0
    ready.run(0.001)
    assert flag(ready, IRQ_U3_TX) == 1


def test_a_full_transmitter_is_not_written(ready: VirtualChip) -> None:
    start_uart(ready)
    for _ in range(10):
        ready.write_register(U3TX, 0)
    assert "U3TXREG written while the transmitter is full" in ready.fault


# ---- ports ----


def test_pins_are_analogue_inputs_after_a_reset(ready: VirtualChip) -> None:
    """12: ANSEL and TRIS are 1; an analogue pin reads 0."""
    ready.drive(pin_number("RE5"), 1)
    assert ready.read_register(port("E", 0x20)) >> 5 & 1 == 0
    ready.write_register(port("E", 0x00) + CLR, 1 << 5)
    assert ready.read_register(port("E", 0x20)) >> 5 & 1 == 1


def test_pulls(ready: VirtualChip) -> None:
    for letter, up in (("D", 1), ("A", 0)):
        pin = pin_number(f"R{letter}0")
        ready.write_register(port(letter, 0x00) + CLR, 1)
        ready.write_register(port(letter, 0x50 if up else 0x60) + SET, 1)
        assert ready.read_register(port(letter, 0x20)) & 1 == up
        ready.drive(pin, 1 - up)
        assert ready.read_register(port(letter, 0x20)) & 1 == 1 - up


def test_change_notice_by_edges(ready: VirtualChip) -> None:
    """12: with EDGEDETECT, CNEN watches rising and CNNE falling edges; CNF says which pin until it is cleared."""
    ready.write_register(port("D", 0x70), ON | 1 << 11)
    ready.write_register(port("D", 0x80) + SET, 1 << 11)
    pin = pin_number("RD11")
    ready.drive(pin, 1)
    ready.run(0.00001)
    assert flag(ready, IRQ_CN_D) == 1 and ready.read_register(port("D", 0xB0)) == 1 << 11
    clear(ready, IRQ_CN_D)
    ready.run(0.00001)
    assert flag(ready, IRQ_CN_D) == 1
    ready.write_register(port("D", 0xB0), 0)
    clear(ready, IRQ_CN_D)
    ready.drive(pin, 0)
    ready.run(0.00001)
    assert flag(ready, IRQ_CN_D) == 0
    ready.write_register(port("D", 0xA0) + SET, 1 << 11)
    ready.drive(pin, 1)
    ready.write_register(port("D", 0xB0), 0)
    clear(ready, IRQ_CN_D)
    ready.drive(pin, 0)
    ready.run(0.00001)
    assert flag(ready, IRQ_CN_D) == 1


# ---- flash ----

PAGE = 0x1D180000


def program(chip: VirtualChip, address: int, words: tuple[int, ...], operation: int = 2) -> None:
    chip.write_register(NVMADDR, address)
    for n, value in enumerate(words):
        chip.write_register(NVMDATA + 0x10 * n, value)
    chip.write_register(NVMCON, 1 << 14 | operation)
    for key in (0, 0xAA996655, 0x556699AA):
        chip.write_register(NVMKEY, key)
    chip.write_register(NVMCON + SET, ON)


def test_four_words_are_programmed_and_a_page_erased(ready: VirtualChip) -> None:
    program(ready, PAGE + 16, (1, 2, 3, 4))
    assert ready.read_register(NVMCON) & ON
    ready.run(0.001)
    assert not ready.read_register(NVMCON) & ON
    at = 0x180000
    assert ready.flash()[at : at + 48] == b"\xff" * 16 + struct.pack("<4I", 1, 2, 3, 4) + b"\xff" * 16
    program(ready, PAGE, (), operation=4)
    ready.run(0.1)
    assert ready.flash()[at : at + 16384] == b"\xff" * 16384


def test_flash_is_programmed_once(ready: VirtualChip) -> None:
    program(ready, PAGE, (1, 2, 3, 4))
    ready.run(0.001)
    program(ready, PAGE, (1, 2, 3, 4))
    assert "programmed twice" in ready.fault


def test_writing_flash_wants_the_key(ready: VirtualChip) -> None:
    """5: the three writes of NVMKEY, and nothing between them and WR."""
    ready.write_register(NVMADDR, PAGE)
    ready.write_register(NVMCON, 1 << 14 | 2)
    for key in (0, 0xAA996655, 0x556699AA):
        ready.write_register(NVMKEY, key)
    ready.write_register(port("D", 0x30), 0)
    ready.write_register(NVMCON + SET, ON)
    assert "NVMCON.WR set without the key" in ready.fault


def test_the_controller_is_left_alone_while_it_works(ready: VirtualChip) -> None:
    program(ready, PAGE, (1, 2, 3, 4))
    ready.write_register(NVMADDR, PAGE + 16)
    assert "NVMADDR written while the flash is busy" in ready.fault


def test_the_bank_of_the_program_is_not_written(ready: VirtualChip) -> None:
    program(ready, 0x1D080000, (1, 2, 3, 4))
    assert "the bank at 1d080000 is written from which the program runs" in ready.fault


def test_power_cut_in_the_middle_leaves_a_torn_unit(ready: VirtualChip) -> None:
    ready.cut_power(2)
    program(ready, PAGE, (1, 2, 3, 4))
    ready.run(0.001)
    program(ready, PAGE + 16, (1, 2, 3, 4))
    assert ready.run(0.001) == Stop.DARK
    assert ready.flash()[0x180010:0x180020] == b"\xff" * 16 and ready.flash_operations == 2
    ready.power_on()
    assert ready.cpu().pc == 0xBFC00000


# ---- interrupts ----

VECTORS = 0x80002000  # EBase
LOW, HIGH = 0x800, 0xA00


def interrupts(chip: VirtualChip) -> None:
    """T4 at level 3 counts a0 up, OC1 at level 6 a1, each in its own register set; the main program spins."""
    code = struct.pack("<3I", 0x40927801, 0x41606020, SPIN)  # mtc0 s2, EBase; ei; b .
    chip.write_ram(CODE & 0x1FFFFFFF, code + bytes(4))
    cpu = Cpu(pc=CODE, next_pc=CODE + 4)
    cpu.r[18] = VECTORS
    chip.set_cpu(cpu)
    # lui t0, 0xbf81; lui t1, BIT; sw t1, 0x44(t0) (IFS0CLR); addiu a0, a0, 1; eret
    for at, bit in ((LOW, 1 << IRQ_T4), (HIGH, 1 << IRQ_OC1)):
        words = (0x3C08BF81, 0x3C090000 | bit >> 16, 0x35290000 | bit & 0xFFFF, 0xAD090044, 0x24840001, 0x42000018)
        chip.write_ram((VECTORS & 0x1FFFFFFF) + at, struct.pack("<6I", *words))
    for irq, at, level in ((IRQ_T4, LOW, 3), (IRQ_OC1, HIGH, 6)):
        chip.write_register(0xBF810540 + 4 * irq, at)
        chip.write_register(0xBF810140 + 0x10 * (irq // 4) + SET, level << 2 << irq % 4 * 8)
        chip.write_register(0xBF8100C0 + SET, 1 << irq)
    chip.write_register(0xBF810000 + SET, 1 << 12)
    chip.write_register(0xBF810010, 6 << 24 | 3 << 12)


def test_each_interrupt_comes_once_and_counts_its_instructions(ready: VirtualChip) -> None:
    interrupts(ready)
    pulses(ready, period=999, rise=1, fall=500)
    ready.run_until(ready.cycles + 10 * 1000 * TICK + 100)
    for irq, wanted in ((IRQ_T4, 10), (IRQ_OC1, 10)):
        vector = ready.vector(irq)
        assert (vector.count, vector.instructions, vector.most) == (wanted, wanted * 6, 6)


def test_the_main_program_keeps_its_registers(ready: VirtualChip) -> None:
    """Shadow sets (PRISS): a handler's $a0 is another register than the program's."""
    interrupts(ready)
    pulses(ready, period=999, rise=1, fall=500)
    ready.run_until(ready.cycles + 10 * 1000 * TICK + 100)
    assert ready.cpu().r[4] == 0


def test_wait_sleeps_until_an_interrupt(ready: VirtualChip) -> None:
    interrupts(ready)
    ready.write_ram((CODE & 0x1FFFFFFF) + 8, struct.pack("<3I", 0x42000020, 0x1000FFFE, 0))  # wait; b .-4
    pulses(ready, period=49_999, rise=1, fall=10_000)
    before = ready.instructions
    ready.run(0.100001)
    assert ready.vector(IRQ_T4).count == 100
    assert ready.instructions - before < 100 * 2 * (6 + 5)
    assert ready.cycles >= 0.1 * CPU_HZ
