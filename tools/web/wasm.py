"""The core as WebAssembly, for the page's preflight: `python -m web.wasm`.

The same sources as the host library, less what talks to sockets and clocks, by PyPI's zig; so a job in the browser is
the job in `wificnc sim`, bit for bit.
"""

from __future__ import annotations

import subprocess
from pathlib import Path

from wificnc.build.cross import zig_cc
from wificnc.build.host import HEADERS, WARNINGS
from wificnc.build.lock import build_lock
from wificnc.build.objects import Unit, compile_stale, failure, is_older
from wificnc.build.platforms import SYSTEMS, sources_of

ROOT = Path(__file__).resolve().parents[2]
OUTPUT = "build/wasm/core.wasm"
GLUE = "web/wasm/preflight.c"
# sources of targets/pc that are not for a browser
SERVING = ("serve", "page", "net_", "main", "host_wire", "port_posix")
FLAGS = (
    "--target=wasm32-wasi",
    "-Os",
    "-std=c11",
    "-D_POSIX_C_SOURCE=200809L",
    "-ffp-contract=off",
    "-fno-math-errno",
    *WARNINGS,
)
LINK_FLAGS = ("--target=wasm32-wasi", "-mexec-model=reactor", "-Os", "-s")


def build_wasm(root: Path = ROOT) -> Path:
    """The module, built when stale. Raises BuildError."""
    output = root / OUTPUT
    output.parent.mkdir(parents=True, exist_ok=True)
    zig = zig_cc()
    units = [
        Unit(source, output.parent / "obj" / source.relative_to(root).with_suffix(".o")) for source in _sources(root)
    ]
    with build_lock(output.parent):
        command = [*zig, *FLAGS, *(f"-I{root / folder}" for folder in HEADERS)]
        compile_stale(command, units, "zig")
        objects = [unit.object for unit in units]
        if is_older(output, objects):
            _link([*zig, *LINK_FLAGS], objects, output)
    return output


def _sources(root: Path) -> list[Path]:
    found = sources_of(SYSTEMS["linux"], (root / "targets" / "pc").glob("*.c"))
    pc = [path for path in found if not path.name.startswith(SERVING)]
    return sorted([*(root / "core").rglob("*.c"), *(root / "targets" / "sim").glob("*.c"), *pc, root / GLUE])


def _link(command: list[str], objects: list[Path], output: Path) -> None:
    run = subprocess.run(
        [*command, *map(str, objects), "-o", str(output), "-lm"],
        capture_output=True,
        text=True,
        encoding="utf-8",
        errors="replace",
    )
    if run.returncode != 0:
        raise failure(f"{output.name} did not link (zig)", run.stderr)


if __name__ == "__main__":
    path = build_wasm()
    print(f"{path}: {path.stat().st_size:,} bytes")
