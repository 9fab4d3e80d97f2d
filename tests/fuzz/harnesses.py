"""The harnesses, how long an input of each is at most, and what each is built from."""

from __future__ import annotations

from pathlib import Path

from needed import needed_parts
from wificnc.build.checkout import checkout_root
from wificnc.build.host import build_program

HERE = Path(__file__).resolve().parent
LENGTHS = {
    "line_reader": 1024,
    "gcode_line": 1024,
    "program": 1024,
    "machine": 2048,
    "wire": 1024,
    "tcp": 1024,
    "module": 1024,
    "component": 1024,
    "interleave": 512,
    "http": 1024,
    "hub": 512,
    "websocket": 512,
    "mdns": 512,
    "first_contact": 600,
    "improv": 512,
    "ota": 1024,
    "vfd": 512,
}
NAMES = tuple(LENGTHS)
WITH_MACHINE = ("machine", "wire", "tcp", "module", "component", "interleave")  # in virtual time, for seconds
ESP32 = {"improv": ("link/improv.c",), "ota": ("net/ota.c",)}  # the firmware's files in a harness
NOT_PORTABLE = ("wificnc.c", "network.c")  # of linuxcnc: they need HAL and sockets


def build_harness(name: str, output: Path, variant: str, *more: Path, alone: bool = False) -> Path:
    """One harness with everything it drives. Raises BuildError.
    @param alone  of the host library only what it needs is compiled: what the release variant's symbols lead to"""
    sources, flags = [HERE / f"{name}.c", *more], [f"-I{HERE}"]
    if name == "component":
        folder = checkout_root() / "linuxcnc"
        sources += [path for path in sorted(folder.glob("*.c")) if path.name not in NOT_PORTABLE]
        flags.append(f"-I{folder}")
    if name in ESP32:
        folder = checkout_root() / "targets" / "esp32"
        sources += [folder / path for path in ESP32[name]]
        flags.append(f"-I{folder}")
    parts = needed_parts(sources, flags, output.with_suffix(".objects")) if alone else None
    return build_program(sources, output, variant, flags, parts)
