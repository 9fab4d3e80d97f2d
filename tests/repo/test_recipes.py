"""docs/contributing.md, done: its edits in a copy of the tree, generated, built and run.

The edits are the page's own: a fenced block with a title is one of them, a `sh` block is a command.
"""

from __future__ import annotations

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import textwrap
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from quick_compiler import quick_compiler

pytestmark = pytest.mark.slow  # builds copies of the tree

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs/contributing.md").read_text(encoding="utf-8")
BLOCK = re.compile(r'^( *)```(\w+)(?: title="([^"]+)")?\n(.*?)^ *```$', re.DOTALL | re.MULTILINE)
MAX_EDITS = 2
TIMEOUT_S = 300
LEFT_OUT = ("examples/", "docs/images/", "tests/")  # large, and nothing here needs them
NEEDED = ("tests/support/", "tests/wire/", "tests/repo/")


@dataclass(frozen=True)
class Block:
    """A fenced block: an edit of `path`, or commands."""

    language: str
    path: str
    text: str


def recipes() -> dict[str, list[Block]]:
    """Heading -> its blocks."""
    parts = re.split(r"^## (.+)\n", PAGE, flags=re.MULTILINE)
    return {
        title: [Block(found[2], found[3] or "", textwrap.dedent(found[4])) for found in BLOCK.finditer(text)]
        for title, text in zip(parts[1::2], parts[2::2], strict=True)
    }


RECIPES = recipes()
PAGE_OF_BOARD = """
from pathlib import Path
from pages.site import site_texts
print(site_texts(Path())["docs/boards/my-mill.md"])
"""


def edited(text: str, diff: str) -> str:
    """The file after the edit, whose place must be the only one."""
    lines = diff.splitlines(keepends=True)
    old = "".join(line[1:] for line in lines if line[0] != "+")
    new = "".join(line[1:] for line in lines if line[0] != "-")
    assert text.count(old) == 1, f"this place is there {text.count(old)} times:\n{old}"
    return text.replace(old, new)


def apply(tree: Path, block: Block) -> None:
    target = tree / block.path
    if block.language == "diff":
        target.write_text(edited(target.read_text(encoding="utf-8"), block.text), encoding="utf-8")
    elif block.path:
        assert not target.exists(), block.path
        target.write_text(block.text, encoding="utf-8")
    else:
        run(tree, "sh", "-ec", block.text)


def build_target(tree: Path) -> None:
    """The compiler's command on the page, with the compiler of this computer."""
    command = next(block.text for block in RECIPES["A target"] if block.text.startswith("cc "))
    run(tree, "sh", "-ec", shlex.quote(str(tree / "build" / "cc")) + command.removeprefix("cc"))


def run(tree: Path, *command: str, ok: bool = True) -> str:
    """What it printed; in the copy, with the copy's own modules."""
    modules = ("cli", "emulators", "tools", "tests/support", "tests/wire")
    compiler = str(tree / "build" / "cc")
    environment = {
        **os.environ,
        "CC": compiler,
        "PYTHONPATH": os.pathsep.join(str(tree / module) for module in modules),
    }
    done = subprocess.run(
        command, cwd=tree, env=environment, capture_output=True, text=True, timeout=TIMEOUT_S, check=False
    )
    assert (done.returncode == 0) == ok, done.stdout + done.stderr
    return done.stdout


def python(tree: Path, *arguments: str, ok: bool = True) -> str:
    return run(tree, sys.executable, *arguments, ok=ok)


def copy_tree(copy: Path) -> None:
    """What git keeps and these tests need."""
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    for path in listed.splitlines():
        if (ROOT / path).is_file() and (path.startswith(NEEDED) or not path.startswith(LEFT_OUT)):
            (copy / path).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / path, copy / path)


@pytest.fixture(scope="module")
def tree(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy with all recipes done, and generated."""
    copy = tmp_path_factory.mktemp("recipes")
    copy_tree(copy)
    (copy / "build").mkdir()
    quick_compiler(copy / "build")
    for blocks in RECIPES.values():
        for block in blocks:
            if not block.text.startswith("cc "):
                apply(copy, block)
    python(copy, "-m", "generate")
    return copy


@pytest.fixture(scope="module")
def results(tree: Path) -> dict[str, Any]:
    """Line or request -> what the controller of that tree made of it."""
    words = [
        *("$99=1", "$$", "$I+", "G4 P3600.5", "G4 P3", "?", "G4.1 P250", "G4.1", "request:Uptime"),
        *("$80=5", "$80=4", "$81=50", "G1 X10 F1000", "G1 Y78.53982"),
    ]
    said = json.loads(python(tree, "tests/repo/recipe_device.py", *words))
    return dict(zip(words, said, strict=True))


@pytest.mark.parametrize("title", RECIPES)
def test_a_recipe_is_two_edits_at_most(title: str) -> None:
    """A copy that is edited afterwards is one edit."""
    blocks = RECIPES[title]
    copies = {block.text.split()[-1] for block in blocks if block.text.startswith("cp ")}
    edits = [block for block in blocks if block.path and block.path not in copies]
    assert 1 <= len(copies) + len(edits) <= MAX_EDITS


def test_an_edit_without_its_place_is_found() -> None:
    with pytest.raises(AssertionError, match="0 times"):
        edited("one\ntwo\n", " three\n+four\n")
    with pytest.raises(AssertionError, match="2 times"):
        edited("one\none\n", " one\n+four\n")
    assert edited("one\ntwo\n", " one\n+new\n-two\n") == "one\nnew\n"


def test_everything_is_generated(tree: Path) -> None:
    python(tree, "-m", "generate", "--check")


def test_the_setting(tree: Path, results: dict[str, Any]) -> None:
    assert results["$99=1"]["said"] == "ok\r\n"
    assert "$99=1\r\n" in results["$$"]["said"]
    assert "|Up:3>" in results["?"]["said"]
    assert "| $99 | `report_uptime` |" in (tree / "docs/settings.md").read_text(encoding="utf-8")
    assert '"name": "report_uptime"' in (tree / "build/generated/tables.json").read_text(encoding="utf-8")


def test_the_error(tree: Path, results: dict[str, Any]) -> None:
    assert results["G4 P3600.5"]["said"] == "error:155\r\n"
    assert results["G4 P3"]["said"] == "ok\r\n"
    words = python(tree, "-c", "from wificnc.connection.words import ERRORS; print(ERRORS[155])")
    assert words == "a dwell is at most an hour\n"
    assert "| 155 | a dwell is at most an hour |" in (tree / "docs/errors.md").read_text(encoding="utf-8")


def test_the_gcode(tree: Path, results: dict[str, Any]) -> None:
    assert results["G4.1 P250"]["said"] == "ok\r\n"
    assert results["G4.1 P250"]["seconds"] == pytest.approx(0.25, abs=0.01)
    assert results["G4.1"]["said"] == "error:28\r\n"
    assert ",G4.1," in results["$I+"]["said"]
    assert "| G4.1 | P | dwell P milliseconds | more |" in (tree / "docs/gcode.md").read_text(encoding="utf-8")


def test_the_packet(tree: Path, results: dict[str, Any]) -> None:
    reply = results["request:Uptime"]
    assert reply["reply"] == "UptimeResponse"
    assert reply["uptime_s"] == int(reply["now_s"]) >= 3
    page = (tree / "docs/protocol.md").read_text(encoding="utf-8")
    assert "\n### uptime_response\n" in page
    assert "uptime_s = 3600" in page


def test_the_board(tree: Path) -> None:
    python(tree, "-m", "wificnc", "boards", "check", "my-mill")
    assert '"My mill"' in python(tree, "-m", "wificnc", "dev", "pins", "my-mill")
    for path, line in {
        "platformio.ini": "[env:my-mill-debug]",
        "boards.json": '"My mill"',
        "pinout/my-mill.svg": "<svg",
    }.items():
        assert line in (tree / "build/generated" / path).read_text(encoding="utf-8"), path
    page = python(tree, "-c", PAGE_OF_BOARD)
    assert "wificnc flash my-mill" in page and "## Every pin" in page


def kept(tree: Path) -> dict[str, bytes]:
    """Contents of all files that git would keep."""
    files = (path for path in tree.rglob("*") if path.is_file() and path.suffix != ".pyc")
    names = {path.relative_to(tree).as_posix(): path for path in files}
    return {name: path.read_bytes() for name, path in names.items() if not name.startswith("build/")}


def changed_by(title: str, tree: Path) -> set[str]:
    """Names of the files that git would keep, and that a recipe and `make generate` change."""
    copy_tree(tree)
    before = kept(tree)
    for block in RECIPES[title]:
        apply(tree, block)
    python(tree, "-m", "generate")
    python(tree, "-m", "generate", "--check")
    after = kept(tree)
    return {name for name in before | after if before.get(name) != after.get(name)}


def test_a_board_is_one_file(tmp_path: Path) -> None:
    assert changed_by("A board", tmp_path) == {"boards/my-mill.toml"}


def test_a_setting_is_its_row_and_its_use(tmp_path: Path) -> None:
    """By hand; the others are written. No language needs its words."""
    edited_by_hand = {block.path for block in RECIPES["A setting"]}
    names = "from pathlib import Path; from generate.__main__ import GENERATORS as all; "
    written = json.loads(
        python(ROOT, "-c", names + "import json; print(json.dumps([name for one in all for name in one(Path())]))")
    )
    assert edited_by_hand < changed_by("A setting", tmp_path) <= edited_by_hand | set(written)


def test_the_translation(tree: Path) -> None:
    words = json.loads((tree / "web/words/tables.de.json").read_text(encoding="utf-8"))
    assert words["report uptime"] == "Laufzeit melden"


def test_the_kinematics(tree: Path, results: dict[str, Any]) -> None:
    """A quarter turn of a tube with a radius of 50 mm, at 200 steps per mm or degree."""
    assert results["$80=5"]["said"] == "error:2\r\n"
    assert results["$80=4"]["said"] == "ok\r\n"
    assert results["G1 X10 F1000"]["steps"][:2] == [2000, 0]
    assert results["G1 Y78.53982"]["steps"][:2] == [2000, 18000]
    assert "| 4 | `tube` |" in (tree / "docs/kinematics.md").read_text(encoding="utf-8")


def test_the_target(tree: Path) -> None:
    build_target(tree)
    assert (tree / "build/my_chip").stat().st_size > 0
