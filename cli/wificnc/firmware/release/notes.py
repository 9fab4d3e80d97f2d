"""Release notes: the version's section of CHANGELOG.md, and what was and was not built. Pure."""

from __future__ import annotations

import re
from collections.abc import Mapping

from wificnc.errors import ReleaseError

SECTION = re.compile(r"^## \[(?P<name>[^\]]+)\](?: - (?P<date>\d{4}-\d\d-\d\d))?[ \t]*$", re.MULTILINE)
UNRELEASED = "Unreleased"


def changes(changelog: str, version: str, *, final: bool) -> str:
    """Of this version; before it has a section, what is not released yet.

    Raises:
        ReleaseError: a final release has no dated section, or there is nothing at all.
    """
    heads = list(SECTION.finditer(changelog))
    ends = [*(head.start() for head in heads[1:]), None]
    bodies = {head["name"]: changelog[head.end() : end].strip() for head, end in zip(heads, ends, strict=False)}
    dated = {head["name"] for head in heads if head["date"]}
    body = bodies.get(version, "")
    if final and not (version in dated and body):
        raise ReleaseError(
            f"CHANGELOG.md has no dated section of {version}, and a release needs one",
            hint=f"rename [{UNRELEASED}] to [{version}] - YYYY-MM-DD",
        )
    body = body or bodies.get(UNRELEASED, "")
    if not body:
        raise ReleaseError(f"CHANGELOG.md has a section neither of {version} nor [{UNRELEASED}]")
    return body


def notes_text(version: str, revision: str, body: str, missing: Mapping[str, str]) -> str:
    """@param missing  board -> why it has no firmware here"""
    lines = [f"# WiFiCNC {version}", "", f"Built from commit {revision}.", "", body, ""]
    if missing:
        lines += ["## Not in this build", "", *(f"- {board}: {why}" for board, why in missing.items()), ""]
    lines += [
        "`sha256sum -c SHA256SUMS` checks the files you downloaded. Each file's board and kind: release.json.",
        "",
    ]
    return "\n".join(lines)
