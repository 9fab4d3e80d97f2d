"""The hosts of the motion and the protocol tests serve here, too."""

from __future__ import annotations

import sys
from pathlib import Path

for folder in ("motion", "grbl"):
    sys.path.append(str(Path(__file__).parents[1] / folder))
