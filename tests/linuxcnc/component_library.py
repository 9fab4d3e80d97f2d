"""The LinuxCNC component without LinuxCNC: linuxcnc/ but for its main program, as a shared library."""

from __future__ import annotations

import ctypes
import os
import shlex
import subprocess
from functools import cache
from pathlib import Path

from c_library import load
from layouts import LINUXCNC
from wificnc.build.checkout import checkout_root
from wificnc.build.compiler import locate_compiler

AXES = 6
FLAGS = ["-std=c11", "-O2", "-g", "-fPIC", "-shared", "-Ilinuxcnc", "-Icore"]
WARNINGS = ["-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-Werror"]
CORE = tuple(
    f"core/{name}.c"
    for name in ("access/key", "base/sha256", "base/siphash", "wire/packet", "wire/seal", "wire/wire_gen")
)
NOT_HERE = ("wificnc.c", "network.c")  # HAL and sockets

HANDLE = ctypes.c_void_p
MAKE_PIN = LINUXCNC.prototype("pins_make")[1][1]
Sample = LINUXCNC.struct("sample")
World = LINUXCNC.struct("peer_world")
Options = LINUXCNC.struct("link_options")
Segment = LINUXCNC.struct("wire_segment")
Slicer = LINUXCNC.struct("slicer")
Status = LINUXCNC.struct("wire_status")
IoControl = LINUXCNC.struct("wire_io_control")
AtSpeed = LINUXCNC.struct("at_speed")
SEND, RANDOM, AWAIT, SAY = (dict(World._fields_)[name] for name in ("send_udp", "random", "await_servo", "say"))


def numbered(_ctx: object, to: int, count: int) -> None:
    """Bytes that repeat in virtual time; the nonce of a test need not be unpredictable."""
    ctypes.memmove(to, bytes(range(count)), count)


@cache
def library() -> ctypes.CDLL:
    """Compiled again in each session: it takes a second, and is never stale."""
    root = checkout_root()
    folder = root / "build" / "tests"
    folder.mkdir(parents=True, exist_ok=True)
    built = folder / f"linuxcnc-{os.getpid()}.so"
    sources = [str(path) for path in sorted((root / "linuxcnc").glob("*.c")) if path.name not in NOT_HERE]
    sources += [*CORE, str(Path(__file__).with_name("component.c"))]
    flags = [*FLAGS, *WARNINGS, *shlex.split(os.environ.get("WIFICNC_TEST_CFLAGS", ""))]
    subprocess.run([*locate_compiler(), *flags, *sources, "-o", str(built), "-lm"], cwd=root, check=True)
    return _declare(load(built.replace(folder / "linuxcnc.so"), LINUXCNC))


def _declare(lib: ctypes.CDLL) -> ctypes.CDLL:
    """What component.c adds."""
    for name, result, *arguments in (
        ("component_link", HANDLE),
        ("component_peer", HANDLE, HANDLE),
        ("component_pins", HANDLE, ctypes.c_uint),
        ("component_is_open", ctypes.c_bool, HANDLE),
        ("component_encoder", HANDLE),
        ("component_module", HANDLE),
        ("component_module_pins", HANDLE),
        ("component_module_peer", HANDLE, HANDLE),
    ):
        function = getattr(lib, name)
        function.restype, function.argtypes = result, arguments
    return lib
