"""A hook of the package's build: the README as the description that a package index shows, without the repository.

Links to files of the repository become their text, and its pictures are left out.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from hatchling.metadata.plugin.interface import MetadataHookInterface

PICTURE = re.compile(r"!\[[^\]]*\]\((?!https?:)[^)]*\)\n*")
LINK = re.compile(r"\[([^\]]*)\]\((?!https?:)[^)]*\)")
COMMENT = re.compile(r"<!--.*?-->\n", re.DOTALL)


def description(readme: str) -> str:
    """What remains when there are no files around."""
    for pattern, text in ((COMMENT, ""), (PICTURE, ""), (LINK, r"\1")):
        readme = pattern.sub(text, readme)
    return readme


class Readme(MetadataHookInterface):
    """The value of `readme` in [project]."""

    def update(self, metadata: dict[str, Any]) -> None:
        text = (Path(self.root) / "README.md").read_text(encoding="utf-8")
        metadata["readme"] = {"content-type": "text/markdown", "text": description(text)}
