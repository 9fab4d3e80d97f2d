"""The PC target on every kind of computer that a release is made for: it compiles without a warning, it links, it
exports what Python calls, and where an emulator is installed it makes this computer's step edges, and serves."""

from __future__ import annotations

import os
import shutil
import socket
import subprocess
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from subprocess import PIPE
from typing import IO

import pytest
import wine
from everywhere import ROOT, TRACE_DIGEST, programs
from patience import BUILD_S, HANG_S
from wificnc.build.cross import CrossBuild, build_platform, build_platform_program, compile_for
from wificnc.build.host import build_program, host_sources
from wificnc.build.platforms import ENDINGS, PLATFORMS, SYSTEMS, sources_of

EVERY = sorted(PLATFORMS)
# All seven take ten minutes: `make platforms`, and each night. Windows and macOS run the quick tests on computers of
# their own (ci.yml), with sources of their own.
EMULATED = [name for name in EVERY if PLATFORMS[name].emulator]
INSTALL = {"wine": wine.MISSING}
WHOLE_JOB = ROOT / "examples" / "inlay.nc"
SERVE = ROOT / "targets" / "pc" / "main.c"

# The first bytes of the files that a linker makes, and the processor's number with the offset that it has there.
MACHINE = {
    "linux-x86_64": (b"\x7fELF\x02", 18, b"\x3e\x00"),
    "linux-aarch64": (b"\x7fELF\x02", 18, b"\xb7\x00"),
    "linux-armv7": (b"\x7fELF\x01", 18, b"\x28\x00"),
    "macos-arm64": (b"\xcf\xfa\xed\xfe", 4, b"\x0c\x00\x00\x01"),
    "macos-x86_64": (b"\xcf\xfa\xed\xfe", 4, b"\x07\x00\x00\x01"),
    "windows-x86_64": (b"MZ", -1, b"PE\0\0\x64\x86"),
    "windows-arm64": (b"MZ", -1, b"PE\0\0\x64\xaa"),
}


@cache
def built(name: str) -> CrossBuild:
    return build_platform(PLATFORMS[name])


@cache
def digest_here(text: bytes) -> str:
    program = build_program([TRACE_DIGEST], ROOT / "build" / "tests" / "trace_digest", "release", [])
    return digest([str(program)], text)


def digest(argv: list[str], text: bytes, environment: dict[str, str] | None = None) -> str:
    run = subprocess.run(argv, input=text, capture_output=True, timeout=BUILD_S, check=True, env=environment)
    return run.stdout.decode()


def is_for(name: str, file: Path) -> bool:
    magic, offset, machine = MACHINE[name]
    content = file.read_bytes()
    if offset < 0:  # of an image of Windows the header's place is in its first one
        offset = int.from_bytes(content[0x3C:0x40], "little")
    return content.startswith(magic) and content[offset : offset + len(machine)] == machine


def test_the_seven_are_there() -> None:
    assert sorted(MACHINE) == EVERY
    assert len({platform.wheel_tag for platform in PLATFORMS.values()}) == len(EVERY)


@pytest.mark.parametrize("system", sorted(SYSTEMS))
def test_a_system_compiles_the_sources_of_no_other(system: str) -> None:
    chosen = host_sources(ROOT, SYSTEMS[system])
    ours = {path.stem for path in chosen if path.stem.endswith(SYSTEMS[system].ending)}
    assert {f"port{SYSTEMS[system].ending}", f"net_pty{SYSTEMS[system].ending}"} <= ours
    others = [ending for ending in ENDINGS if ending != SYSTEMS[system].ending]
    assert not [path for path in chosen if path.stem.endswith(tuple(others))]


def test_each_source_of_one_system_has_its_counterpart() -> None:
    sources = sorted((ROOT / "targets").rglob("*.c"))
    missing = {ending: {path.stem for path in sources if path.stem.endswith(ending)} for ending in ENDINGS}
    posix, windows = ({stem.removesuffix(ending) for stem in stems} for ending, stems in missing.items())
    assert posix == windows and posix
    assert sources_of(SYSTEMS["linux"], sources) != sources


def test_only_the_port_asks_which_system_it_is() -> None:
    words = ("_WIN32", "__APPLE__", "__linux__")
    found = [
        path.name
        for folder in ("core", "targets/net", "targets/pc", "targets/sim")
        for path in sorted((ROOT / folder).rglob("*.[ch]"))
        if any(word in path.read_text() for word in words)
    ]
    assert found == ["net_system.h"]


@pytest.mark.slow
def test_the_sources_of_windows_compile_without_a_warning() -> None:
    """Its own ones: all others are compiled for this computer, too."""
    platform = PLATFORMS["windows-x86_64"]
    own = [path for path in host_sources(ROOT, platform.system) if path.stem.endswith(platform.system.ending)]
    objects, warnings = compile_for(platform, own, ROOT)
    assert objects and warnings == ""


@pytest.mark.deep
@pytest.mark.parametrize("name", EVERY)
def test_the_library_links_without_a_warning(name: str) -> None:
    build = built(name)
    assert build.warnings == ""
    assert is_for(name, build.library)
    exported = {name.removeprefix(b"_") for name in build.library.read_bytes().split(b"\0")}  # macOS puts a _ before
    assert {b"sim_create", b"page_listen", b"host_create"} <= exported


@pytest.mark.deep
@pytest.mark.parametrize("name", EVERY)
def test_the_server_links_without_a_warning(name: str) -> None:
    program, warnings = build_platform_program(built(name), SERVE, "wificnc-serve")
    assert warnings == ""
    assert is_for(name, program)


@pytest.fixture(scope="module")
def environment(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, str]]:
    """Of emulators."""
    if not wine.has_wine():
        yield dict(os.environ)
        return
    with wine.wine_environment(tmp_path_factory.mktemp("wine")) as found:
        yield found


def emulator_of(name: str) -> str:
    emulator = PLATFORMS[name].emulator
    assert emulator
    if shutil.which(emulator) is None:
        pytest.skip(INSTALL.get(emulator, f"{emulator} is not installed; Debian: apt-get install qemu-user"))
    return emulator


@pytest.mark.deep
@pytest.mark.parametrize("name", EMULATED)
def test_an_emulated_computer_steps_as_this_one(name: str, environment: dict[str, str]) -> None:
    emulator = emulator_of(name)
    program, _ = build_platform_program(build_platform(PLATFORMS[name].emulated()), TRACE_DIGEST, "trace_digest")
    jobs = {**programs(), "a whole job": WHOLE_JOB.read_bytes()}
    text = b"".join(job + b"\0" for job in jobs.values())
    found = digest([emulator, str(program)], text, environment).splitlines()
    wanted = digest_here(text).splitlines()
    assert len(wanted) == len(jobs)
    assert [job for job, one, other in zip(jobs, wanted, found, strict=True) if one != other] == []


@pytest.mark.deep
@pytest.mark.parametrize("name", EMULATED)
def test_an_emulated_computer_serves(name: str, environment: dict[str, str]) -> None:
    """A client connects, asks, streams a job that is faster than it runs, and the program ends with its parent."""
    emulator = emulator_of(name)
    program, _ = build_platform_program(build_platform(PLATFORMS[name].emulated()), SERVE, "wificnc-serve")
    command = [emulator, str(program), "--parent", "--speed", "0", "--host", "127.0.0.1", "--port", "0"]
    with subprocess.Popen(command, stdin=PIPE, stdout=PIPE, env=environment) as server:
        assert server.stdin and server.stdout
        try:
            address = doors(server.stdout)["tcp"].rpartition(":")
            with socket.create_connection((address[0], int(address[2])), HANG_S) as client:
                stream_a_job(client)
            server.stdin.close()
            assert server.wait(HANG_S) == 0
        finally:
            server.kill()


def doors(lines: IO[bytes]) -> dict[str, str]:
    """What the program opens until it is ready."""
    found = {}
    for line in lines:
        words = line.decode().split()
        if words == ["ready"]:
            return found
        found[words[0]] = words[1]
    raise AssertionError(f"the program ended before it was ready: {found}")


def stream_a_job(client: socket.socket) -> None:
    """50 lines, each sent when the one before is answered; then the position is that of the last one."""
    with client.makefile("rwb") as both:
        for number in range(50):
            both.write(b"G1X%dY%dF3000\n" % (number % 7, number % 5))
            both.flush()
            assert answer(both) == b"ok"
        both.write(b"G4P0\n")
        both.flush()
        assert answer(both) == b"ok"  # all of it has been executed
        both.write(b"?")
        both.flush()
        assert b"|MPos:0.000,4.000,0.000" in next(line for line in both if line.startswith(b"<"))


def answer(lines: IO[bytes]) -> bytes:
    """The next line that is neither a greeting nor a report."""
    for line in lines:
        if line.strip() and not line.startswith((b"Grbl", b"[", b"<")):
            return line.strip()
    raise AssertionError("the server closed the connection")
