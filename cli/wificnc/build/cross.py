"""The library and programs of the PC target for other kinds of computers (platforms.PLATFORMS), by PyPI's zig."""

from __future__ import annotations

import importlib.util
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from wificnc.build.checkout import checkout_root
from wificnc.build.frames import pc_frame_flags
from wificnc.build.host import FLAGS, HEADERS, host_sources
from wificnc.build.lock import build_lock
from wificnc.build.objects import Unit, compile_stale, failure, is_older, put_in_place
from wificnc.build.platforms import Platform
from wificnc.errors import BuildError

RELEASE_FLAGS = ("-O2", "-g0")
STRIP = "-s"


@dataclass(frozen=True)
class CrossBuild:
    """What a build for a platform made."""

    platform: Platform
    library: Path
    objects: tuple[Path, ...]
    warnings: str  # of the compiler and the linker, for what was stale


def build_platform(platform: Platform, *, root: Path | None = None) -> CrossBuild:
    """Bring the library of a platform up to date, in build/platforms/NAME.

    Args:
        platform: which one.
        root: of the sources.

    Raises:
        BuildError: it did not compile or link.
    """
    root = root or checkout_root()
    directory = root / "build" / "platforms" / platform.name
    library = directory / platform.system.library
    with build_lock(directory):
        objects, warnings = compile_for(platform, host_sources(root, platform.system), root)
        if is_older(library, objects):
            warnings += _link(platform, ["-shared", *platform.system.link_flags], objects, library)
    return CrossBuild(platform, library, objects, warnings)


def build_platform_program(build: CrossBuild, source: Path, name: str) -> tuple[Path, str]:
    """Link a program of one source with the platform's objects.

    Returns:
        The program, and the warnings of its compiler and linker.

    Raises:
        BuildError: it did not compile or link.
    """
    root = checkout_root()
    directory = build.library.parent
    output = directory / f"{name}{build.platform.system.program_suffix}"
    with build_lock(directory):
        own, warnings = compile_for(build.platform, [source], root)
        objects = [*own, *build.objects]
        if is_older(output, objects):
            warnings += _link(build.platform, [], objects, output)
    return output, warnings


def require_zig() -> None:
    """Raises BuildError when it is not there."""
    if importlib.util.find_spec("ziglang") is None:
        raise BuildError(
            "zig is not installed, and it compiles for other computers", hint="pip install -e '.[release]'"
        )


def zig_cc() -> list[str]:
    """The compiler itself: `python -m ziglang` starts Python for each file. Raises BuildError."""
    require_zig()
    spec = importlib.util.find_spec("ziglang")
    assert spec is not None and spec.origin is not None
    return [str(Path(spec.origin).with_name("zig")), "cc"]


def compile_for(platform: Platform, sources: Sequence[Path], root: Path) -> tuple[tuple[Path, ...], str]:
    """Compile what is stale of these.

    Returns:
        The objects, and the compiler's warnings.

    Raises:
        BuildError: something did not compile.
    """
    folder = root / "build" / "platforms" / platform.name / "obj"
    units = [
        Unit(path, folder / path.relative_to(root).with_suffix(".o"), pc_frame_flags(path, root, family="clang"))
        for path in sources
    ]
    flags = [*platform.target_flags, *FLAGS, *platform.system.flags, *RELEASE_FLAGS]
    command = [*zig_cc(), *flags, *(f"-I{root / path}" for path in HEADERS)]
    _, warnings = compile_stale(command, units, f"zig cc for {platform.name}")
    return tuple(unit.object for unit in units), warnings


def _link(platform: Platform, options: Sequence[str], objects: Sequence[Path], output: Path) -> str:
    """The linker's warnings."""
    fresh = output.with_name(f"new-{output.name}")
    argv = [*zig_cc(), *platform.target_flags, *options, STRIP, *map(str, objects), "-o", str(fresh)]
    run = subprocess.run(
        [*argv, *platform.system.libraries],
        capture_output=True,
        text=True,
        encoding="utf-8",
        errors="replace",
        stdin=subprocess.DEVNULL,
    )
    if run.returncode != 0:
        raise failure(f"{output.name} for {platform.name} did not link", run.stderr)
    put_in_place(fresh, output)
    return run.stderr
