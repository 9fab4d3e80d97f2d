"""The core as WebAssembly, for the page's preflight: `python -m web.wasm`.

The same sources as the host library, less what talks to sockets and clocks, by PyPI's zig; so a job in the browser is
the job in `wificnc sim`, bit for bit. Binaryen, of web/package.json, makes it smaller: a controller has it in flash.
"""

from __future__ import annotations

import subprocess
from pathlib import Path

from wificnc.build.cross import zig_cc
from wificnc.build.frames import pc_frame_flags
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
OPTIMIZER = "web/node_modules/binaryen/bin/wasm-opt"
OPTIMIZER_FLAGS = (
    "-Oz",
    *(f"--enable-{name}" for name in ("bulk-memory", "mutable-globals", "nontrapping-float-to-int", "sign-ext")),
)


def build_wasm(root: Path = ROOT) -> Path:
    """The module, built when stale. Needs npm's packages. Raises BuildError."""
    output = root / OUTPUT
    output.parent.mkdir(parents=True, exist_ok=True)
    zig = zig_cc()
    units = [
        Unit(
            source,
            output.parent / "obj" / source.relative_to(root).with_suffix(".o"),
            pc_frame_flags(source, root, family="clang"),
        )
        for source in _sources(root)
    ]
    with build_lock(output.parent):
        command = [*zig, *FLAGS, *(f"-I{root / folder}" for folder in HEADERS)]
        compile_stale(command, units, "zig")
        objects = [unit.object for unit in units]
        if is_older(output, objects):
            linked = output.with_suffix(".linked")
            _run([*zig, *LINK_FLAGS, *map(str, objects), "-o", str(linked), "-lm"], f"{output.name} did not link (zig)")
            optimizer = ["node", str(root / OPTIMIZER), *OPTIMIZER_FLAGS, str(linked), "-o", str(output)]
            _run(optimizer, f"{output.name} did not become smaller (Binaryen)")
    return output


def _sources(root: Path) -> list[Path]:
    found = sources_of(SYSTEMS["linux"], (root / "targets" / "pc").glob("*.c"))
    pc = [path for path in found if not path.name.startswith(SERVING)]
    return sorted([*(root / "core").rglob("*.c"), *(root / "targets" / "sim").glob("*.c"), *pc, root / GLUE])


def _run(command: list[str], what: str) -> None:
    run = subprocess.run(command, capture_output=True, text=True, encoding="utf-8", errors="replace")
    if run.returncode != 0:
        raise failure(what, run.stderr)


if __name__ == "__main__":
    path = build_wasm()
    print(f"{path}: {path.stat().st_size:,} bytes")
