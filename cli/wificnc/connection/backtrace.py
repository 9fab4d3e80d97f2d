"""The backtrace that an ESP32 prints when it crashes, as places in the sources."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

from wificnc.errors import UserError

# The toolchain's own, then LLVM's and the computer's, which read the debug information of any processor.
TOOLS = ("xtensa-esp-elf-addr2line", "xtensa-esp32s3-elf-addr2line", "xtensa-esp32-elf-addr2line",
         "llvm-addr2line", "llvm-addr2line-22", "addr2line")  # fmt: skip
BACKTRACE = re.compile(r"^Backtrace:((?:\s*0x[0-9a-fA-F]+:0x[0-9a-fA-F]+)+)")
CALL = re.compile(r"0x([0-9a-fA-F]+):0x")


def addresses(line: str) -> list[int]:
    """Of a `Backtrace:` line, the newest call first; else none. What follows a call: one instruction back."""
    match = BACKTRACE.match(line.strip())
    return [int(text, 16) for text in CALL.findall(match[1])] if match else []


def find_tool(packages: Path | None = None) -> str | None:
    """An addr2line: PlatformIO's, or one on the PATH."""
    bundled = sorted(packages.glob("toolchain-xtensa*/bin/*-addr2line")) if packages else []
    found = [str(path) for path in bundled] + [path for name in TOOLS if (path := shutil.which(name))]
    return found[0] if found else None


class Decoder:
    """Says where in the sources the calls of a backtrace stand."""

    def __init__(self, elf: Path, tool: str | None) -> None:
        """Raises UserError when there is no tool for it."""
        if tool is None:
            raise UserError("addr2line is not installed, and backtraces need it", hint="apt-get install binutils")
        self._command = [tool, "-fCe", str(elf)]

    def decode(self, line: str) -> list[str]:
        """One line a call: `motion_poll at motion.c:82`; none when it is not a backtrace."""
        found = addresses(line)
        if not found:
            return []
        words = [hex(address if index == 0 else address - 1) for index, address in enumerate(found)]
        run = subprocess.run(
            [*self._command, *words], capture_output=True, text=True, encoding="utf-8", errors="replace", check=False
        )
        said = run.stdout.splitlines()
        if run.returncode != 0 or len(said) != 2 * len(found):
            return [f"  0x{address:08x}" for address in found]
        return [f"  0x{a:08x}  {said[2 * i]} at {said[2 * i + 1]}" for i, a in enumerate(found)]
