"""The table has room: forty more settings need no other edit."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest
from generate import settings
from generate.__main__ import run
from settings_core import NUMBERS, ROOT
from wificnc.build.compiler import locate_compiler
from wificnc.build.host import HEADERS

MORE = 40
FIRST = 800
ROW = """
[[setting]]
number = {number}
name = "more_{number}_ms"
type = "u16"
unit = "ms"
default = 7
min = 0
max = 1000
help = "One more."
affects = ["reports"]
nvs = "more_{number}"
"""
HOST = [*(f"-I{folder}" for folder in HEADERS), "-D_GNU_SOURCE"]
ROOMS = {"core": HOST, "targets/pc": HOST, "targets/pic32mz/store": ["-Icore", "-Itargets/pic32mz"]}

# Stores all of them but their defaults, and reads them back.
ROUND_TRIP = r"""
#include "settings/store.h"
#include <string.h>
static uint8_t kept[STORE_IMAGE_MAX];
static size_t size;
static size_t load(const void *ctx, uint8_t key, void *bytes, size_t room) {
    (void)ctx, (void)key, memcpy(bytes, kept, size < room ? size : room);
    return size;
}
static enum hal_store_state save(const void *ctx, const struct hal_store_value *values, size_t count) {
    (void)ctx, (void)count, memcpy(kept, values->bytes, size = values->count);
    return HAL_STORE_DONE;
}
int main(void) {
    static const struct hal_store ops = {.load = load, .save = save};
    const struct store store = {.ops = &ops};
    struct settings written = {0}, read = {0};
    struct store_lost lost;
    settings_defaults(&written), settings_defaults(&read);
    for (uint16_t number = %(first)d; number < %(first)d + %(more)d; number++)
        if (settings_set(&written, number, number, 6) != STATUS_OK)
            return 1;
    if (!store_save_settings(&store, &written) || store_load_settings(&store, &read, 6, &lost) != STORE_FOUND)
        return 2;
    return memcmp(&written, &read, sizeof read) == 0 ? 0 : 3;
}
"""


@pytest.fixture(scope="module")
def tree(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the sources with that many settings more, generated."""
    root = tmp_path_factory.mktemp("more")
    for room in ("core", "protocol", "targets", "docs"):
        shutil.copytree(ROOT / room, root / room, ignore=shutil.ignore_patterns("site", "*.png", "*.svg"))
    table = root / settings.SOURCE
    more = "".join(ROW.format(number=number) for number in range(FIRST, FIRST + MORE))
    table.write_text(table.read_text(encoding="utf-8") + more, encoding="utf-8")
    assert run([settings.texts], root) == 0
    return root


def compiled(tree: Path, *arguments: str) -> None:
    done = subprocess.run([*locate_compiler(), "-std=c11", *arguments], cwd=tree, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


@pytest.mark.slow
@pytest.mark.parametrize("room", ROOMS)
def test_everything_still_compiles(tree: Path, room: str) -> None:
    assert all(setting.number < FIRST for setting in NUMBERS)
    paths = [path for path in sorted((tree / room).rglob("*.c")) if not path.stem.endswith("_windows")]
    sources = [str(path.relative_to(tree)) for path in paths]
    compiled(tree, "-fsyntax-only", "-Wall", "-Wextra", "-Werror", *ROOMS[room], *sources)


def test_they_are_stored(tree: Path) -> None:
    (tree / "round_trip.c").write_text(ROUND_TRIP % {"first": FIRST, "more": MORE}, encoding="utf-8")
    sources = sorted(str(path.relative_to(tree)) for path in (tree / "core/settings").glob("*.c"))
    compiled(tree, "-Icore", "round_trip.c", *sources, "-o", "round_trip")
    assert subprocess.run([tree / "round_trip"], check=False).returncode == 0
