"""What stops a virtual chip."""

from __future__ import annotations

from wificnc.errors import UserError


class ChipFault(UserError):
    """The image did what a chip would silently get wrong, or what is not emulated; or it is no image for the chip."""
