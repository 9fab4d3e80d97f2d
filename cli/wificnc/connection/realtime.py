"""Real-time bytes: they act immediately, wherever they are in the stream, and are never answered by ok.

The browser console has them from here, too (tools/generate/page_tables.py).
"""

from __future__ import annotations

STATUS = b"?"
HOLD = b"!"
RESUME = b"~"
RESET = b"\x18"
DOOR = b"\x84"
JOG_CANCEL = b"\x85"
FULL_STATUS = b"\x87"
FEED_100 = b"\x90"
FEED_PLUS_10 = b"\x91"
FEED_MINUS_10 = b"\x92"
FEED_PLUS_1 = b"\x93"
FEED_MINUS_1 = b"\x94"
RAPID_100 = b"\x95"
RAPID_50 = b"\x96"
RAPID_25 = b"\x97"
SPINDLE_100 = b"\x99"
SPINDLE_PLUS_10 = b"\x9a"
SPINDLE_MINUS_10 = b"\x9b"
SPINDLE_PLUS_1 = b"\x9c"
SPINDLE_MINUS_1 = b"\x9d"
SPINDLE_STOP = b"\x9e"
FLOOD = b"\xa0"
MIST = b"\xa1"
PARK = b"\xa3"
