"""How much of its stack the image has used: painted before power-on, and looked at afterwards. Interrupts are in it:
all of them run on this stack."""

from __future__ import annotations

from chip_controller import Controller
from wificnc.build.image import elf_symbols
from wificnc.build.pic32mz import Pic32Build

STACK_BUDGET = 12 * 1024  # of 16 KB (targets/pic32mz/chip/pic32mz.ld)
PAINT = 0xA5

# What goes deepest: the whole store, computed lines, jogs, arcs, lists, a tool.
DEEPEST = (
    *("$RST=$", "$$", "$#", "$I+", "$N0=G21", "$N0=", "$110=5000", "$120=500", "$111=5000", "$121=500"),
    *("#1=[[[[1+2]*[3-[4/5]]]+SIN[30]]**2]", "#<_long>=[#1*ATAN[1]/[2]]", "G1X[#1/9]F2000", "G91", "$J=G91X1F500"),
    *("G2X2Y0I1J0F1500", "G5X1Y1I0J1P0Q-1", "G83Z-2R1Q0.5F900", "G80", "G10L1P1Z1(a tool)", "T1", "G43H1", "G49"),
    *("G10L2P1X1", "G28.1", "G90", "$G", "$RST=#"),
)


def _place(build: Pic32Build) -> tuple[int, int]:
    """Physical address and bytes."""
    symbols = elf_symbols(build.elf.read_bytes())
    size = symbols["_stack_size"]
    return (symbols["_stack_top"] - size) & 0x1FFFFFFF, size


def paint_stack(controller: Controller, build: Pic32Build) -> None:
    """Before the chip runs."""
    base, size = _place(build)
    controller.chip.write_ram(base, bytes([PAINT]) * size)


def stack_used(controller: Controller, build: Pic32Build) -> int:
    """Bytes from its top to the lowest that was written since paint_stack()."""
    base, size = _place(build)
    left = controller.chip.read_ram(base, size)
    return size - (len(left) - len(left.lstrip(bytes([PAINT]))))
