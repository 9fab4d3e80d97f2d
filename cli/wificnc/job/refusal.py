"""What to do about a line that the controller refuses."""

from __future__ import annotations

UNSUPPORTED = 20  # error of a code that does not exist here


def refusal_hint(code: int) -> str:
    """@param code  of the controller's answer"""
    if code == UNSUPPORTED:
        return "docs/gcode.md lists the codes: make the program with a post-processor for Grbl, or remove the code"
    return "correct the line; docs/errors.md explains the error"
