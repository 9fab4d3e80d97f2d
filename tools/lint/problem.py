"""What a lint finds, and which files it looks at."""

from __future__ import annotations

import subprocess
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, order=True)
class Problem:
    """One broken rule at one place."""

    path: Path
    line: int
    message: str

    def __str__(self) -> str:
        return f"{self.path}:{self.line}: {self.message}"


def tracked_files(root: Path) -> list[Path]:
    """Files that git knows or would take, relative to root; all files when root is not a git checkout."""
    if (root / ".git").exists():
        argv = ["git", "-C", str(root), "ls-files", "--cached", "--others", "--exclude-standard", "-z"]
        names = subprocess.run(argv, capture_output=True, check=True).stdout.decode().split("\0")
        paths = [Path(name) for name in names if name]
    else:
        paths = [path.relative_to(root) for path in root.rglob("*") if path.is_file()]
    return sorted({path for path in paths if (root / path).is_file()})


def source_files(root: Path, *suffixes: str) -> list[Path]:
    """Tracked files with one of these suffixes."""
    return [path for path in tracked_files(root) if path.suffix in suffixes]
