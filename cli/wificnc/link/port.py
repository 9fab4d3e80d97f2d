"""The TCP port on which a controller listens unless told otherwise; also that of `wificnc serve`."""

from __future__ import annotations

DEFAULT_PORT = 2323
