"""What a device's refusal is in words: what was refused, why, and what to do about it."""

from __future__ import annotations

from collections.abc import Mapping

from wificnc.connection.wmc3.layout import Refusal, Type
from wificnc.connection.wmc3.remedies import MEANINGS, REMEDIES
from wificnc.errors import RefusedError

# What to do at the command line, where that is more than what any host does.
HINTS: dict[Refusal, str] = {
    Refusal.LOCKED: "check the machine, release the e-stop, then wificnc wmc3 reset",
    Refusal.OWNER: "wificnc wmc3 counters shows the owner; motion is released when the owner stops sending",
    Refusal.UNKNOWN_TYPE: "wificnc wmc3 handshake shows the capabilities of this device",
    Refusal.READ_ONLY: "the board file decides it (boards/), or this target does not have it",
    Refusal.AUTHENTICATION: "--key, or WIFICNC_KEY; or wificnc login, for all programs of this computer",
    Refusal.IO_MODULE: "wificnc wmc3 channel and output are for it",
    Refusal.PIN: "boards/ and docs/esp32.md list the free pins and the input-only pins",
    Refusal.NOT_OUTPUT: "wificnc wmc3 channel N --output --pin P makes it one",
}
# Of one request.
HINTS_OF: dict[tuple[Type, Refusal], str] = {
    (
        Type.AUTHENTICATE,
        Refusal.AUTHENTICATION,
    ): "--key, or WIFICNC_KEY; after wrong keys the answer comes up to 4 s later",
    (
        Type.CHANNEL_OUTPUTS,
        Refusal.UNKNOWN_TYPE,
    ): "only an I/O module has these outputs (docs/protocol.md)",
    (Type.CONFIG_SET, Refusal.BUSY): "set it while the machine is idle",
    (Type.RESUME, Refusal.BUSY): "nothing is held",
    (Type.RESET, Refusal.BUSY): "motion is active or queued: wificnc wmc3 status; hold or estop stops it",
}


def refused_error(kind: Type, reason: int, what: str = "", hints: Mapping[Refusal, str] | None = None) -> RefusedError:
    """@param what: the request's object, where its type does not say enough. @param hints: of this request"""
    request = f"{kind.name.lower()}{' of ' + what if what else ''}"
    if reason not in set(Refusal):
        return RefusedError(
            f"the device refuses {request}: reason {reason}",
            hint="this wificnc is older than the device and does not know the reason",
        )
    why = Refusal(reason)
    hint = (hints or {}).get(why) or HINTS_OF.get((kind, why)) or HINTS.get(why) or REMEDIES[why]
    return RefusedError(f"the device refuses {request}: {why.name.lower()} ({MEANINGS[why]})", hint=hint)
