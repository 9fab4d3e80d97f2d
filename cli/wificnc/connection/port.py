"""TCP ports at which controllers listen: `wificnc serve`, and boards with a network (targets/esp32/main/online.c)."""

from __future__ import annotations

SERVE_PORT = 2323
BOARD_PORT = 23
