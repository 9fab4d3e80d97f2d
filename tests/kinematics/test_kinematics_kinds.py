"""The table of kinds in protocol/settings.toml and the files of core/motion/kinematics say the same."""

from __future__ import annotations

import pytest
from kinematics_core import COREXY, POLAR, SCARA, Machine
from wificnc.tables import load_settings

KINDS = load_settings()["kinematics"].choice


@pytest.mark.parametrize("value", range(len(KINDS)), ids=[kind.name for kind in KINDS])
def test_a_kind_that_bends_lines_is_called_curved(value: int) -> None:
    assert KINDS[value].curved == Machine(value).bends_lines


def test_only_corexy_is_coupled() -> None:
    for value, kind in enumerate(KINDS):
        assert Machine(value).is_coupled == (value == COREXY), kind.name
    assert (KINDS[POLAR].name, KINDS[SCARA].name) == ("polar", "scara")
