"""The pictures of docs/motion.md show what the planner does now: each is drawn again, and its curves are compared."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from numpy.typing import NDArray
from patience import HANG_S
from wificnc.build.checkout import checkout_root

pytestmark = pytest.mark.slow  # draws, and makes step traces

ROOT = checkout_root()
IMAGES = ROOT / "docs" / "images"
NAMES = sorted(path.stem for path in IMAGES.glob("motion-*.svg"))
PATH = "{http://www.w3.org/2000/svg}path"
SAME_PT = 0.5  # of a picture of 684; a version of the library may move all by less
NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e-?\d+)?")
USED = re.compile(r"!\[[^\]]{10,}\]\(images/(motion-[a-z]+)\.svg\)")


def curves(text: str) -> list[NDArray[np.float64]]:
    """What is drawn of data, points in pt: it is cut at the edges of its axes, and letters are not."""
    found = []
    for path in ElementTree.fromstring(text).iter(PATH):
        if path.get("clip-path"):
            numbers = [float(number) for number in NUMBER.findall(path.get("d", ""))]
            found.append(np.array(numbers).reshape(-1, 2))
    return found


def far_pt(points: NDArray[np.float64], curve: NDArray[np.float64]) -> float:
    """The largest distance of a point from a curve, which may have other points."""
    begin, along = curve[:-1], np.diff(curve, axis=0)
    length2 = np.maximum((along**2).sum(axis=1), 1e-12)
    largest = 0.0
    for point in points:
        share = np.clip(((point - begin) * along).sum(axis=1) / length2, 0, 1)
        nearest = begin + share[:, None] * along
        largest = max(largest, float(np.min(np.linalg.norm(point - nearest, axis=1))))
    return largest


@pytest.fixture(scope="module")
def drawn(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of what `make pictures` draws now."""
    folder = tmp_path_factory.mktemp("pictures")
    argv = [sys.executable, "-m", "motion.pictures", str(folder)]
    done = subprocess.run(argv, cwd=ROOT / "tools", capture_output=True, text=True, timeout=HANG_S, check=False)
    assert done.returncode == 0, done.stderr
    return folder


@pytest.mark.parametrize("name", NAMES)
def test_a_picture_shows_what_is_drawn_now(drawn: Path, name: str) -> None:
    old, new = (curves((folder / f"{name}.svg").read_text(encoding="utf-8")) for folder in (IMAGES, drawn))
    assert len(old) == len(new) > 0, "make pictures"
    far = [max(far_pt(a, b), far_pt(b, a)) for a, b in zip(old, new, strict=True) if len(b) > 1]
    assert max(far) <= SAME_PT, f"curve {int(np.argmax(far))} is {max(far):.1f} pt away: make pictures"


def test_each_picture_is_drawn_and_in_the_page(drawn: Path) -> None:
    assert sorted(path.stem for path in drawn.iterdir()) == NAMES
    assert sorted(USED.findall((ROOT / "docs" / "motion.md").read_text(encoding="utf-8"))) == NAMES
