"""The LinuxCNC component without LinuxCNC: linuxcnc/ but for its main program, as a shared library."""

from __future__ import annotations

import ctypes
import os
import shlex
import subprocess
from functools import cache
from pathlib import Path

from wificnc.build.checkout import checkout_root
from wificnc.build.compiler import locate_compiler

AXES = 6
FLAGS = ["-std=c11", "-O2", "-g", "-fPIC", "-shared", "-Ilinuxcnc", "-Icore"]
WARNINGS = ["-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-Werror"]
CORE = ("core/wire/packet.c", "core/wire/wire_gen.c", "core/base/sha256.c")
NOT_HERE = ("wificnc.c", "network.c")  # HAL and sockets

HANDLE, SIZE, DATA, DOUBLE = ctypes.c_void_p, ctypes.c_size_t, ctypes.c_char_p, ctypes.c_double
SEND = ctypes.CFUNCTYPE(None, HANDLE, ctypes.POINTER(ctypes.c_uint8), SIZE)
AWAIT = ctypes.CFUNCTYPE(None, HANDLE)
SAY = ctypes.CFUNCTYPE(None, HANDLE, DATA)
MAKE_PIN = ctypes.CFUNCTYPE(ctypes.c_int, HANDLE, DATA, ctypes.c_int, ctypes.c_int, ctypes.POINTER(HANDLE))


class Sample(ctypes.Structure):
    """struct sample"""

    _fields_ = [("command", DOUBLE * AXES), ("servo_s", DOUBLE), ("motion_type", ctypes.c_int32)]


class World(ctypes.Structure):
    """struct peer_world"""

    _fields_ = [("ctx", HANDLE), ("send_udp", SEND), ("send_tcp", SEND), ("await_servo", AWAIT), ("say", SAY)]


class Options(ctypes.Structure):
    """struct link_options"""

    _fields_ = [("joints", ctypes.c_uint), ("level_s", DOUBLE), ("run_up_s", DOUBLE), ("password", DATA)]


class Segment(ctypes.Structure):
    """struct wire_segment"""

    _fields_ = [
        ("steps", ctypes.c_int32 * AXES),
        ("duration_us", ctypes.c_uint32),
        ("entry_speed_sq", ctypes.c_uint32),
        ("exit_speed_sq", ctypes.c_uint32),
        ("acceleration", ctypes.c_uint32),
        ("id", ctypes.c_uint16),
        ("flags", ctypes.c_uint8),
    ]


class Slicer(ctypes.Structure):
    """struct slicer"""

    _fields_ = [
        ("joints", ctypes.c_uint),
        ("scale", DOUBLE * AXES),
        ("rate", DOUBLE * AXES),
        ("level_s", DOUBLE),
        ("steps", ctypes.c_int32 * AXES),
        ("stands", ctypes.c_uint),
    ]


class Status(ctypes.Structure):
    """struct wire_status, the fields up to those of the spindle"""

    _fields_ = [
        ("position_steps", ctypes.c_int32 * AXES),
        ("buffer", ctypes.c_uint16 * 2),
        ("bytes", ctypes.c_uint8 * 8),
        ("segment_id", ctypes.c_uint16),
        ("uptime_ms", ctypes.c_uint32),
        ("rate_steps_s", ctypes.c_int32),
        ("misc_outputs", ctypes.c_uint8),
        ("misc_inputs", ctypes.c_uint8),
        ("spindle", ctypes.c_uint8),
        ("coolant", ctypes.c_uint8),
        ("rpm", ctypes.c_uint16),
        ("spindle_angle", ctypes.c_uint16),
        ("spindle_turns", ctypes.c_uint32),
        ("io", ctypes.c_uint16 * 2),
    ]


class IoControl(ctypes.Structure):
    """struct wire_io_control"""

    _fields_ = [
        ("misc_outputs", ctypes.c_uint8),
        ("spindle", ctypes.c_uint8),
        ("rpm", ctypes.c_uint16),
        ("coolant", ctypes.c_uint8),
    ]


class AtSpeed(ctypes.Structure):
    """struct at_speed"""

    _fields_ = [("run_up_s", DOUBLE), ("spindle", ctypes.c_uint8), ("rpm", ctypes.c_uint16), ("since_s", DOUBLE)]


@cache
def library() -> ctypes.CDLL:
    """Compiled anew in each session: it takes a second, and is never stale."""
    root = checkout_root()
    folder = root / "build" / "tests"
    folder.mkdir(parents=True, exist_ok=True)
    built = folder / f"linuxcnc-{os.getpid()}.so"
    sources = [str(path) for path in sorted((root / "linuxcnc").glob("*.c")) if path.name not in NOT_HERE]
    sources += [*CORE, str(Path(__file__).with_name("component.c"))]
    flags = [*FLAGS, *WARNINGS, *shlex.split(os.environ.get("WIFICNC_TEST_CFLAGS", ""))]
    subprocess.run([*locate_compiler(), *flags, *sources, "-o", str(built), "-lm"], cwd=root, check=True)
    return _declare(ctypes.CDLL(str(built.replace(folder / "linuxcnc.so"))))


def _declare(lib: ctypes.CDLL) -> ctypes.CDLL:
    position, pointer = DOUBLE * AXES, ctypes.POINTER
    for name, result, *arguments in (
        ("component_link", HANDLE),
        ("component_peer", HANDLE, HANDLE),
        ("component_pins", HANDLE, ctypes.c_uint),
        ("component_is_open", ctypes.c_bool, HANDLE),
        ("component_encoder", HANDLE),
        ("pins_make", ctypes.c_int, HANDLE, MAKE_PIN, HANDLE),
        ("component_module", HANDLE),
        ("component_module_pins", HANDLE),
        ("component_module_peer", HANDLE, HANDLE),
        ("module_make_pins", ctypes.c_int, HANDLE, MAKE_PIN, HANDLE),
        ("module_begin", None, HANDLE, HANDLE, pointer(World), DATA, DOUBLE),
        ("module_tick", DATA, HANDLE, DOUBLE),
        ("module_lose", None, HANDLE),
        ("link_begin", None, HANDLE, HANDLE, pointer(World), pointer(Options), DOUBLE),
        ("peer_hear_udp", None, HANDLE, DATA, SIZE, DOUBLE),
        ("peer_hear_tcp", None, HANDLE, DATA, SIZE, DOUBLE),
        ("link_sample", None, HANDLE, pointer(Sample), DOUBLE),
        ("link_note_lost_samples", None, HANDLE, ctypes.c_uint32),
        ("link_tick", DATA, HANDLE, DOUBLE),
        ("link_follow_spindle", None, HANDLE, DOUBLE),
        ("link_lose", None, HANDLE),
        ("slicer_slice", ctypes.c_int, pointer(Slicer), position, DOUBLE, DOUBLE, pointer(Segment)),
        ("slicer_far", ctypes.c_int, pointer(Slicer), position, DOUBLE),
        ("encoder_take", None, HANDLE, ctypes.c_uint32, DOUBLE, pointer(Status)),
        ("encoder_update", DOUBLE, HANDLE, DOUBLE, pointer(ctypes.c_bool)),
        ("encoder_speed_rps", DOUBLE, HANDLE),
        ("at_speed_update", ctypes.c_bool, pointer(AtSpeed), DOUBLE, pointer(IoControl), pointer(Status), HANDLE),
    ):
        function = getattr(lib, name)
        function.restype, function.argtypes = result, arguments
    return lib
