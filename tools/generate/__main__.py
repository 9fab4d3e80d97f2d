"""Write every generated file that differs from its sources. With --check, write nothing, and name those that git keeps;
what git does not keep is built.py's."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from pydantic import ValidationError

from generate import (
    boards,
    built,
    codes,
    files,
    install,
    kinds,
    lights,
    nvs,
    settings,
    states,
    tmc,
    version,
    vfd,
    wire,
    words,
)

ROOT = Path(__file__).resolve().parents[2]
GENERATORS: tuple[Callable[[Path], files.Texts], ...] = (
    version.texts,
    settings.texts,
    kinds.texts,
    vfd.texts,
    tmc.texts,
    wire.texts,
    boards.texts,
    codes.texts,
    lights.texts,
    states.texts,
    nvs.texts,
    words.texts,
    install.texts,
)


def main(argv: Sequence[str] | None = None, root: Path = ROOT) -> int:
    """Exit code 1: --check found a stale file, or a table is wrong."""
    parser = argparse.ArgumentParser(prog="python -m generate", description=__doc__)
    parser.add_argument("--check", action="store_true", help="write nothing, fail if a file is stale")
    check: bool = parser.parse_args(argv).check
    try:
        return run(GENERATORS, root, check) if check else run(GENERATORS, root) or built.main(root)
    except ValidationError as err:
        for fault in err.errors():
            where = ".".join(map(str, fault["loc"]))
            print(f"error: {err.title}{f': {where}' if where else ''}: {fault['msg']}", file=sys.stderr)
        return 1


def run(generators: Sequence[Callable[[Path], files.Texts]], root: Path, check: bool = False) -> int:
    """Exit code, as main()."""
    old: list[str] = []
    for generator in generators:
        texts = generator(root)
        old += files.stale(texts, root) if check else files.write(texts, root)
    for path in old:
        print(f"{path} is stale: run `make generate`" if check else f"wrote {path}", file=sys.stderr)
    return 1 if check and old else 0


if __name__ == "__main__":
    sys.exit(main())
