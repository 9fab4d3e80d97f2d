"""Programs with register windows and a level-5 interrupt in an emulator: LLVM's code for the ESP32, on a core that has
what counts here (dc233c: windows of 32 registers, six interrupt levels, compare-and-swap) but no float."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

from xtensa.compile import CPU, Object, compile_all
from xtensa.headers import Headers
from xtensa.toolchain import Toolchain

LINKER, QEMU = "xtensa-lx106-elf-ld", "qemu-system-xtensa"
PACKAGES = "llvm-22 binutils-xtensa-lx106 qemu-system-misc"

# An interrupt may come at each instruction, and always at the same ones: one instruction a block, time by instructions.
MACHINE = ("-M", "sim", "-cpu", "dc233c", "-m", "64M", "-display", "none", "-serial", "none", "-monitor", "none")
EXACT = ("-singlestep", "-icount", "shift=6")

LAYOUT = """ENTRY(reset)
MEMORY { ram (rwx) : ORIGIN = 0x2000, LENGTH = 48M  rom (rx) : ORIGIN = 0xfe000000, LENGTH = 4K }
SECTIONS {
    .reset : { *(.reset) } > rom
    .vectors 0x2000 : { *(.vectors) } > ram
    .text : SUBALIGN(4) { *(.boot .literal .literal.* .text .text.* .iram1 .iram1.*) } > ram
    .data : { *(.rodata .rodata.* .data .data.*) } > ram
    .bss (NOLOAD) : { *(.bss .bss.* COMMON) } > ram
}
"""


def assembler(tools: Toolchain) -> str:
    """llvm-mc of the same release."""
    return tools.llc.replace("llc", "llvm-mc")


def missing(tools: Toolchain) -> str:
    """What to install; "" when all is here."""
    here = all(shutil.which(program) for program in (assembler(tools), LINKER, QEMU))
    return "" if here else f"apt-get install {PACKAGES}"


def build(tools: Toolchain, root: Path, headers: Headers, sources: Sequence[Path], output: Path) -> Path:
    """Compile, assemble and link. Raises RuntimeError with what a tool said."""
    c_files = [path for path in sources if path.suffix == ".c"]
    objects = compile_all(tools, root, headers, c_files, output, kinds=("asm",))
    return link(tools, [*(path for path in sources if path.suffix == ".S"), *texts(objects)], output, LAYOUT)


def texts(objects: Sequence[Object]) -> list[Path]:
    """Assembly of C files that link() takes. Raises RuntimeError with what a compiler said."""
    if said := "".join(made.said for made in objects):
        raise RuntimeError(said)
    found = []
    for made in objects:
        found.append(made.path.with_suffix(".aligned.s"))
        aligned = _align_literals(made.assembly.read_text())
        if not found[-1].is_file() or found[-1].read_text() != aligned:
            found[-1].write_text(aligned)
    return found


def object_name(text: Path) -> str:
    """Of an assembled file: two folders may have files of one name."""
    return f"{text.parent.name}_{text.stem}.o"


def link(tools: Toolchain, sources: Sequence[Path], output: Path, script: str) -> Path:
    """Assemble and link. @param script  of the linker. Raises RuntimeError with what a tool said."""
    output.mkdir(parents=True, exist_ok=True)
    files = [str(output / object_name(text)) for text in sources]
    for text, file in zip(sources, files, strict=True):
        if Path(file).is_file() and Path(file).stat().st_mtime_ns > text.stat().st_mtime_ns:
            continue
        _run([assembler(tools), "--arch=xtensa", f"-mcpu={CPU}", "-filetype=obj", str(text), "-o", file])
    layout, program = output / "link.ld", output / "program.elf"
    layout.write_text(script)
    _run([LINKER, "--no-warn-rwx-segments", "-z", "noexecstack", "-T", str(layout), *files, "-o", str(program)])
    return program


def _align_literals(text: str) -> str:
    """LLVM 22 puts a function's literals after the code of the one before, wherever that ends."""
    return text.replace("\t.literal_position", "\t.p2align 2\n\t.literal_position")


def run(program: Path, seconds: float) -> int:
    """Its exit code. Raises TimeoutExpired when it does not end."""
    command = [QEMU, *MACHINE, *EXACT, "-semihosting", "-kernel", str(program)]
    return subprocess.run(command, capture_output=True, timeout=seconds, check=False).returncode


def _run(command: Sequence[str]) -> None:
    done = subprocess.run(command, capture_output=True, text=True, stdin=subprocess.DEVNULL, check=False)
    if done.returncode != 0:
        raise RuntimeError(done.stderr)
