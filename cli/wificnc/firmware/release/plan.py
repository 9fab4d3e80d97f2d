"""What a release will be: which boards are in it, and every file by name. Pure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from wificnc.board.model import Board
from wificnc.build.platforms import PLATFORMS, Platform
from wificnc.errors import ReleaseError
from wificnc.firmware.release.wheel import PURE_TAG, wheel_tag

Kind = Literal["image", "package", "source", "component", "header", "page", "record"]

# Suffix of a board's file -> what it is, in the order of people's interest.
ESP32_FILES = {
    "-merged.bin": "everything, from address 0; forgets the settings",
    "-bootloader.bin": "bootloader",
    "-partition-table.bin": "partition table",
    "-slot-choice.bin": "which slot starts: the first",
    "-firmware.bin": "the application, also for updates over the network",
    "-firmware.sig": "its signature: ECDSA with P-256 and SHA-256",
    ".uf2": "the same for an ESP USB Bridge",
    ".elf": "for debuggers and backtraces",
}
PIC32MZ_FILES = {".hex": "the image", ".elf": "for debuggers"}
RECORDS = ("RELEASE_NOTES.md", "release.json", "SHA256SUMS")


@dataclass(frozen=True)
class Source:
    """What it is made of."""

    version: str
    revision: str  # commit, with + when files were changed since
    epoch_s: int  # every time in every file

    @property
    def is_clean(self) -> bool:
        return not self.revision.endswith("+")


@dataclass(frozen=True)
class Asset:
    """A file of dist/."""

    name: str
    kind: Kind
    board: str | None
    what: str


@dataclass(frozen=True)
class Missing:
    """A board without firmware."""

    board: Board
    why: str


@dataclass(frozen=True)
class Plan:
    """A release."""

    source: Source
    boards: tuple[Board, ...]  # with firmware in it
    missing: tuple[Missing, ...] = ()
    platforms: tuple[Platform, ...] = ()  # each has its own wheel

    @property
    def assets(self) -> list[Asset]:
        version = self.source.version
        return [
            *(asset for board in self.boards for asset in board_assets(board, version)),
            Asset(f"wificnc-{version}-{PURE_TAG}.whl", "package", None, "the command, with sources and firmware"),
            *(
                Asset(f"wificnc-{version}-{wheel_tag(one)}.whl", "package", None, f"the same, compiled for {one.name}")
                for one in self.platforms
            ),
            Asset(f"wificnc-{version}.tar.gz", "source", None, "the same as a source distribution"),
            Asset(f"wificnc_chips-{version}-{PURE_TAG}.whl", "package", None, "the virtual chips of --on-chip"),
            Asset(f"wificnc_chips-{version}.tar.gz", "source", None, "the same as a source distribution"),
            Asset(f"wificnc-{version}-linuxcnc.tar.gz", "component", None, "the HAL component of LinuxCNC"),
            Asset(f"wificnc-{version}-protocol.h", "header", None, "the binary protocol for hosts in C"),
            Asset(f"wificnc-{version}-web.tar.gz", "page", None, "web/: the flasher page and its firmware"),
            Asset(f"wificnc-{version}.spdx.json", "record", None, "what is in all of them (SPDX 2.3)"),
            *(Asset(name, "record", None, "") for name in RECORDS),
        ]


def board_assets(board: Board, version: str) -> list[Asset]:
    files = ESP32_FILES if board.target == "esp32" else PIC32MZ_FILES
    return [Asset(f"wificnc-{version}-{board.id}{suffix}", "image", board.id, what) for suffix, what in files.items()]


def plan_release(
    source: Source,
    boards: Sequence[Board],
    why_missing: Mapping[str, str],
    wanted: Sequence[str] = (),
    tag: str = "",
    platforms: Sequence[str] = (),
) -> Plan:
    """@param boards  all that have firmware. @param why_missing  of those for which there is none here
    @param wanted  boards that must be in it; none: all that can be. @param tag  vVERSION: a final release, in which all
    boards must be unless some are named. @param platforms  each has its own wheel

    Raises:
        ReleaseError: a wanted board or platform is unknown, a board is missing, or the tag names another version or
            changed files.
    """
    _check_tag(source, tag)
    if tag and not wanted:
        wanted = [board.id for board in boards]
    known = {board.id: board for board in boards}
    unknown = [name for name in wanted if name not in known]
    if unknown:
        raise ReleaseError(f"no board with firmware: {', '.join(unknown)}", hint=f"there are: {', '.join(known)}")
    chosen = [board for board in boards if not wanted or board.id in wanted]
    missing = tuple(Missing(board, why_missing[board.id]) for board in chosen if board.id in why_missing)
    if wanted and missing:
        lines = [f"  {row.board.id}: {row.why}" for row in missing]
        raise ReleaseError("\n".join(["parts of the release are missing:", *lines]))
    built = tuple(board for board in chosen if board.id not in why_missing)
    return Plan(source, built, missing, _find_platforms(platforms))


def _find_platforms(names: Sequence[str]) -> tuple[Platform, ...]:
    if unknown := [name for name in names if name not in PLATFORMS]:
        raise ReleaseError(f"unknown platform: {', '.join(unknown)}", hint=f"there are: {', '.join(PLATFORMS)}")
    return tuple(platform for name, platform in PLATFORMS.items() if name in names)


def _check_tag(source: Source, tag: str) -> None:
    if tag and tag != f"v{source.version}":
        raise ReleaseError(
            f"the tag is {tag}, and the version {source.version}", hint="__version__ in cli/wificnc/__init__.py"
        )
    if tag and not source.is_clean:
        raise ReleaseError("a final release needs a clean tree, and files were changed since the last commit")
