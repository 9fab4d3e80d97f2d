"""TCP ports at which controllers listen: of `wificnc serve`, and of a target without one; and of boards with a network
(targets/esp32/main/online.c)."""

from __future__ import annotations

DEFAULT_PORT = 2323
BOARD_PORT = 23
