"""How large the stack frame of a C function may be, in every build but those with sanitizers.

A task of the ESP32 has 4 to 13 KB of stack, the PIC32MZ 16 KB: a frame of several KB, such as the temporary of a large
structure, overwrites what lies below it, and no test on a computer sees that. So the compiler refuses it.
"""

from __future__ import annotations

from pathlib import Path

FRAME_BYTES = 1024

# Files and folders that may have more: bytes, reason. The longest name counts.
LARGER: dict[str, tuple[int, str]] = {
    "core/settings/store.c": (2048, "every value of a page together; the controller's task alone comes here"),
    "core/machine/compute.c": (2048, "a line, what it computes, and the line that comes of it"),
    "core/gcode/jog.c": (2048, "a copy of the modes, so that a jog cannot change the program's"),
    "targets/esp32/net/ota.c": (2048, "a piece of an image, 1 KB"),
    "targets/esp32/store/nvs_store.c": (4096, "an image of all settings, and its pairs; the controller's task alone"),
    "targets/net/": (2048, "one datagram or one head of a request"),
    "targets/sim/": (2048, "a whole line and its variants; on a computer alone"),
    "targets/pc/": (2048, "paths and requests; on a computer alone"),
    "targets/pc/serve.c": (4096, "an answer of 4 KB"),
    "targets/pc/serve_claim.c": (4096, "a path of 4 KB"),
    "targets/pc/host_store.c": (10240, "paths of 4 KB and a whole file of settings"),
}

PC_FACTOR = 2  # pointers of 8 bytes, and functions are inlined into each other freely


def frame_limit(source: Path, root: Path) -> int:
    """Bytes that a frame of this file may have on a chip."""
    name = source.relative_to(root).as_posix()
    found = max((row for row in LARGER if name.startswith(row)), key=len, default=None)
    return FRAME_BYTES if found is None else LARGER[found][0]


def firmware_limit(target: str) -> int:
    """The largest of all files of a firmware, such as "esp32": for what is compiled or linked in one call."""
    return max(
        size for name, (size, _) in LARGER.items() if name.startswith(("core/", "targets/net/", f"targets/{target}/"))
    )


def frame_flags(bytes_max: int, *, family: str) -> tuple[str, ...]:
    """What makes a larger frame an error. family: Compiler.family; an unknown compiler gets nothing."""
    if family == "gcc":
        return (f"-Werror=frame-larger-than={bytes_max}",)
    return (f"-Wframe-larger-than={bytes_max}", "-Werror=frame-larger-than") if family == "clang" else ()


def pc_frame_flags(source: Path, root: Path, *, family: str) -> tuple[str, ...]:
    """The same for a computer, Windows' threads of 1 MB included."""
    return frame_flags(PC_FACTOR * frame_limit(source, root), family=family)
