"""What a device's refusal is in words: what was refused, why, and what to do about it."""

from __future__ import annotations

from collections.abc import Mapping

from wificnc.errors import RefusedError
from wificnc.wmc3.layout import Refusal, Type
from wificnc.wmc3.remedies import MEANINGS, REMEDIES

# What to do at the command line, where that is more than what any host does.
HINTS: dict[Refusal, str] = {
    Refusal.LOCKED: "look at the machine, release the e-stop, then wificnc wmc3 reset",
    Refusal.OWNER: "wificnc wmc3 counters says whose it is; it gives motion back when it is silent",
    Refusal.UNKNOWN_TYPE: "wificnc wmc3 handshake says what this device can",
    Refusal.READ_ONLY: "boards/ has the pins, wificnc wifi the network",
    Refusal.AUTHENTICATION: "--password, or WIFICNC_PASSWORD",
    Refusal.IO_MODULE: "wificnc wmc3 channel and output are for it",
    Refusal.PIN: "boards/ and docs/esp32.md say which pins are free, and which are inputs only",
    Refusal.NOT_OUTPUT: "wificnc wmc3 channel N --output --pin P makes it one",
}
# Of one request.
HINTS_OF: dict[tuple[Type, Refusal], str] = {
    (
        Type.AUTHENTICATE,
        Refusal.AUTHENTICATION,
    ): "--password, or WIFICNC_PASSWORD; after a wrong one even the right one "
    "has to wait a second, after more up to a minute",
    (
        Type.CHANNEL_OUTPUTS,
        Refusal.UNKNOWN_TYPE,
    ): "outputs like this are an I/O module's, and this is none (docs/protocol.md)",
    (Type.CONFIG_SET, Refusal.BUSY): "set it while nothing moves and nothing is held",
    (Type.RESUME, Refusal.BUSY): "nothing is held",
    (Type.RESET, Refusal.BUSY): "something moves or waits: wificnc wmc3 status; hold or estop stops it",
}


def refused_error(kind: Type, reason: int, what: str = "", hints: Mapping[Refusal, str] | None = None) -> RefusedError:
    """@param what: the request's object, where its type does not say enough. @param hints: of this request"""
    request = f"{kind.name.lower()}{' of ' + what if what else ''}"
    if reason not in set(Refusal):
        return RefusedError(
            f"the device refuses {request}: reason {reason}",
            hint="it is newer than this wificnc, which does not know that",
        )
    why = Refusal(reason)
    hint = (hints or {}).get(why) or HINTS_OF.get((kind, why)) or HINTS.get(why) or REMEDIES[why]
    return RefusedError(f"the device refuses {request}: {why.name.lower()} ({MEANINGS[why]})", hint=hint)
