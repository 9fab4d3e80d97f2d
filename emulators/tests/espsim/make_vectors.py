"""Write vectors.bin: what qemu-system-xtensa makes of streams.py. Before: apt-get install qemu-system-misc.

The core is de233_fpu: it has what the ESP32's has, but 32 registers for windows, which the streams do not turn.
"""

from __future__ import annotations

import struct
import subprocess
import sys
import tempfile
import zlib
from pathlib import Path

import streams as v
from xtensa_programs import code as c

COMMAND = ("qemu-system-xtensa", "-M", "sim", "-cpu", "de233_fpu", "-m", "16M", "-display", "none", "-serial", "none")
COMMAND += ("-monitor", "none", "-semihosting", "-kernel")
RESET, CODE, DATA = 0xFE000000, 0x4000, 0x100000
WRITE, EXIT, STDOUT = 4, 1, 1  # of simcall


def main() -> int:
    found = b""
    for index in range(v.STREAMS):
        code, data, start = v.stream(index)
        found += v.stored(run(code, data, start), data)
    v.FILE.write_bytes(zlib.compress(found, 9))
    print(f"{v.STREAMS * v.CASES} cases, {v.FILE.stat().st_size} bytes")
    return 0


def run(code: bytes, data: bytes, start: int) -> bytes:
    """The memory afterwards."""
    code = v.aligned(code + c.padded(b"", -len(code) % 4 + 12))
    literals = len(code)
    code += struct.pack("<2I", DATA, len(data))
    for t, value in ((2, WRITE), (3, STDOUT)):
        code += c.movi(t, value)
    for t, at in ((4, literals), (5, literals + 4)):
        code += c.l32r(t, CODE + len(code), CODE + at)
    code += c.SIMCALL + c.movi(2, EXIT) + c.movi(3, 0) + c.SIMCALL
    # the stream's end runs on into a jump over the literals
    code = code[: literals - 3] + c.jump(11) + code[literals:]
    with tempfile.TemporaryDirectory() as folder:
        program = Path(folder) / "program.elf"
        program.write_bytes(elf([(RESET, reset(start)), (CODE, code), (DATA, data)]))
        done = subprocess.run([*COMMAND, str(program)], capture_output=True, check=False)
    if done.returncode != 0 or len(done.stdout) != len(data):
        raise RuntimeError(f"{done.returncode}, {len(done.stdout)} bytes: {done.stderr.decode()}")
    return done.stdout


def reset(start: int) -> bytes:
    """VECBASE, the FPU, no interrupts, and the stream."""
    literals = struct.pack("<3I", CODE, DATA, CODE + start)
    code = c.jump(4 + len(literals)) + b"\0" + literals
    for t in range(3):
        code += c.l32r((2, 1, 4)[t], len(code), 4 + 4 * t)
    code += (
        c.wsr(2, c.VECBASE)
        + c.movi(3, 0x2A)
        + c.wsr(3, c.ATOMCTL)
        + c.movi(3, 1)
        + c.wsr(3, c.CPENABLE)
        + c.movi(3, 15)
        + c.wsr(3, c.PS)
        + c.RSYNC
    )
    return code + c.wide(0, 10, 4)  # jx a4


def elf(pieces: list[tuple[int, bytes]]) -> bytes:
    """A program; it begins where the processor does."""
    headers, body = b"", b""
    begin = 52 + 32 * len(pieces)
    for address, data in pieces:
        headers += struct.pack("<8I", 1, begin + len(body), address, address, len(data), len(data), 7, 4)
        body += data
    magic = b"\x7fELF\x01\x01\x01".ljust(16, b"\0")
    rest = struct.pack("<2H5I6H", 2, 94, 1, RESET, 52, 0, 0x300, 52, 32, len(pieces), 40, 0, 0)
    return magic + rest + headers + body


if __name__ == "__main__":
    sys.exit(main())
