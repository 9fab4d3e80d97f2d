"""A release as `wificnc release` makes it in a fresh repository, with stand-ins for what only PlatformIO can build."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from esp_images import make_build
from patience import BUILD_S
from wificnc.board.load import load_board
from wificnc.build.checkout import checkout_root
from wificnc.build.pic32mz import build_pic32mz
from wificnc.firmware.release.package import tracked_files

ROOT = checkout_root()
ESP32_BOARDS = {"esp32s3-zero": "esp32s3", "esp32-wroom32": "esp32"}
PIC32MZ_BOARD = "pic32mz2048efh100"
ONE_MORE = "boards/pic32mz-gantry.toml"  # its image, too, would be built for each release
PAGE = {"index.html": "<!doctype html><title>page</title>", "assets/page.js": "export {};"}
COMMITTED = "2026-11-01T12:00:00+00:00"


@dataclass(frozen=True)
class Tree:
    """A repository, and what may be built in it here."""

    root: Path
    revision: str

    @property
    def boards(self) -> list[str]:
        built_here = [PIC32MZ_BOARD] if shutil.which("mipsel-linux-gnu-gcc") else []
        return [*ESP32_BOARDS, *built_here]

    def release(self, *arguments: object, code: int = 0, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
        """`wificnc release` of this tree's own package."""
        environment = {**os.environ, "PYTHONPATH": str(self.root / "cli"), "PYTHONDONTWRITEBYTECODE": "1"}
        environment.pop("SOURCE_DATE_EPOCH", None)
        command = [sys.executable, "-m", "wificnc", "release", *map(str, arguments)]
        run = subprocess.run(
            command,
            cwd=cwd or self.root,
            env=environment,
            capture_output=True,
            text=True,
            timeout=BUILD_S,
            check=False,
        )
        assert run.returncode == code, run.stdout + run.stderr
        assert "Traceback" not in run.stderr
        return run


def make_tree(root: Path) -> Tree:
    """What is tracked here, but one of two boards of a kind, as the one commit of a new repository; the same commit
    wherever it is made."""
    for name in tracked_files(ROOT):
        if not name.startswith(("tests/", "emulators/tests/")) and name != ONE_MORE:
            (root / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(ROOT / name, root / name)
    who = ["-c", "user.name=test", "-c", "user.email=test@example.invalid", "-c", "commit.gpgsign=false"]
    dates = {**os.environ, "GIT_AUTHOR_DATE": COMMITTED, "GIT_COMMITTER_DATE": COMMITTED}
    for words in (["init", "-q"], ["add", "-A"], [*who, "commit", "-q", "-m", "all"]):
        subprocess.run(["git", "-C", str(root), *words], env=dates, check=True)
    describe = ["git", "-C", str(root), "describe", "--always", "--abbrev=12"]
    return Tree(root, subprocess.run(describe, capture_output=True, text=True, check=True).stdout.strip())


def build_boards(tree: Tree) -> None:
    """What others have built: boards by PlatformIO, the page by Vite."""
    for name, text in PAGE.items():
        (tree.root / "web" / "dist" / name).parent.mkdir(parents=True, exist_ok=True)
        (tree.root / "web" / "dist" / name).write_text(text)
    for board, chip in ESP32_BOARDS.items():
        make_build(tree.root / "build" / board, board, chip, tree.revision)


def share_objects(tree: Tree) -> None:
    """The core's objects of this checkout's own image: to compile them again takes half a minute. The image is the same
    then, but its debug information names this checkout."""
    if PIC32MZ_BOARD not in tree.boards:
        return
    here = build_pic32mz(load_board(PIC32MZ_BOARD), cc="gcc").elf.parent
    there = tree.root / "build" / PIC32MZ_BOARD
    there.mkdir(parents=True)
    for name in ("pin_config.h", "compiler.json"):  # before the objects, which are newer than their headers
        shutil.copyfile(here / name, there / name)
    shutil.copytree(here / "obj" / "core", there / "obj" / "core", copy_function=shutil.copyfile)
    for listing in there.rglob("*.d"):
        listing.write_text(listing.read_text(encoding="utf-8").replace(str(ROOT), str(tree.root)), encoding="utf-8")
