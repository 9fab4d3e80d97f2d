"""What an alarm means, in the controller's own words. The numbers below 50 are those of Grbl 1.1."""

from __future__ import annotations

from wificnc.connection.words import ALARMS


def alarm_words(code: int) -> str:
    return ALARMS.get(code, "unknown alarm")
