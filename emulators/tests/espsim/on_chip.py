"""What tests of `--on-chip` have in common."""

from __future__ import annotations

import pytest
from wificnc.app import main

JOB = "G21G90\nG1X2F1500\nG2X4Y2I0J2\nM0\nG1X0Y0Z1A1\n"


def wificnc(*arguments: object) -> int:
    """The command in this process. @return its exit code"""
    with pytest.raises(SystemExit) as ended:
        main([str(argument) for argument in arguments])
    return int(ended.value.code or 0)
