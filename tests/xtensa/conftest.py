"""tools/ is no package of the product; tests/native has what every processor runs."""

from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
