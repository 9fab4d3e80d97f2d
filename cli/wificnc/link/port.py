"""The TCP ports at which controllers listen."""

from __future__ import annotations

DEFAULT_PORT = 2323  # of `wificnc serve`, and where a target names none
BOARD_PORT = 23  # targets/esp32/main/online.c
