"""A hook of the package's build: what it requires. Both packages of a release have one version, and go together."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from hatchling.metadata.plugin.interface import MetadataHookInterface

VERSION = re.compile(r'^__version__ = "([^"]+)"$', re.MULTILINE)


class Requirements(MetadataHookInterface):
    """The command whose interfaces it uses, in the version of wificnc_chips/version.py."""

    def update(self, metadata: dict[str, Any]) -> None:
        found = VERSION.search((Path(self.root) / "wificnc_chips" / "version.py").read_text(encoding="utf-8"))
        if found is None:
            raise ValueError("wificnc_chips/version.py has no __version__")
        metadata["dependencies"] = [f"wificnc=={found[1]}"]
