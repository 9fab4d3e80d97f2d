"""One repository and its release for all tests of this folder."""

from __future__ import annotations

from pathlib import Path

import pytest
from release_tree import Tree, build_boards, make_tree, share_objects


@pytest.fixture(scope="session")
def tree(tmp_path_factory: pytest.TempPathFactory) -> Tree:
    made = make_tree(tmp_path_factory.mktemp("release") / "one")
    build_boards(made)
    share_objects(made)
    return made


@pytest.fixture(scope="session")
def dist(tree: Tree) -> Path:
    """The release of that tree, without wheels for one kind of computer: test_wheels.py."""
    tree.release("-o", "dist", "--platforms", "none")
    return tree.root / "dist"
