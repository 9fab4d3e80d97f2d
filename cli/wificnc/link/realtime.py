"""Real-time bytes: they act at once, wherever they stand in the stream, and are never answered by ok."""

from __future__ import annotations

STATUS = b"?"
HOLD = b"!"
RESUME = b"~"
RESET = b"\x18"
JOG_CANCEL = b"\x85"
FEED_100 = b"\x90"
FEED_PLUS_10 = b"\x91"
FEED_MINUS_10 = b"\x92"
