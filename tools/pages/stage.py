"""What the site is made of: README.md, docs/, and every file of the repository that these link to, in the same places;
and the pages that git does not keep (site.py).

So links are the same in the repository and on the site, and a link to nowhere is found.
"""

from __future__ import annotations

import re
import shutil
from pathlib import Path

from pages.commands import PAGE, commands_text
from pages.site import site_texts

FIRST = ("README.md", "CHANGELOG.md")
LINK = re.compile(r"!?\[[^\]]*\]\(\s*<?([^)\s>#]+)[^)]*\)")
OUTSIDE = re.compile(r"^[a-z]+:")


def stage(root: Path, output: Path) -> list[Path]:
    """Copy them there. @return the pages, relative to the root"""
    shutil.rmtree(output, ignore_errors=True)
    files = collect(root)
    for file in files:
        (output / file).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(root / file, output / file)
    for name, text in site_texts(root).items():
        (output / name).parent.mkdir(parents=True, exist_ok=True)
        (output / name).write_text(text, encoding="utf-8", newline="\n")
    page = Path(PAGE)
    (output / page).write_text(commands_text(), encoding="utf-8")
    return [page, *(file for file in files if file.suffix == ".md")]


def collect(root: Path) -> list[Path]:
    """Pages and what they link to, however far away. A link to nowhere is left for the site's builder to find."""
    waiting = [Path(name) for name in FIRST] + [path.relative_to(root) for path in (root / "docs").rglob("*.md")]
    found: set[Path] = set()
    while waiting:
        file = waiting.pop()
        if file not in found:
            found.add(file)
            waiting += linked(root, file) if file.suffix == ".md" else []
    return sorted(found)


def linked(root: Path, page: Path) -> list[Path]:
    """Files of the repository that a page links to."""
    targets = LINK.findall((root / page).read_text(encoding="utf-8"))
    paths = [(root / page.parent / target).resolve() for target in targets if not OUTSIDE.match(target)]
    return [path.relative_to(root) for path in paths if path.is_file() and path.is_relative_to(root)]
