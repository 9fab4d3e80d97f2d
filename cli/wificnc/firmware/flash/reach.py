"""Which firmware runs after an update, and whether it stays: targets/esp32/net/update_trial.h."""

from __future__ import annotations

import time
from dataclasses import dataclass

from wificnc import ui
from wificnc.errors import FlashError
from wificnc.firmware.flash.ota import Hello, Upload

RESTART_S = 3.0  # a firmware that does not report its digest has ended by then
AGAIN_S = 1.0
STEADY_S = 30
TRIAL_MINUTES = 5


@dataclass(frozen=True)
class Patience:
    """How long to wait, s."""

    silent_s: float = 90.0  # its start, and the way into a network
    trial_s: float = 60.0 * TRIAL_MINUTES
    again_s: float = AGAIN_S


def wait_until_kept(host: str, port: int, key: str, digest: str, patience: Patience = Patience()) -> None:
    """Have the new firmware confirmed, and wait until it is, so that it also survives the power switch.

    Raises FlashError when another firmware answers, or none does.
    """
    started = heard = time.monotonic()
    while True:
        try:
            hello = ask(host, port, key, digest)
        except FlashError as err:
            if time.monotonic() - heard >= patience.silent_s:
                raise _lost(host, err.message) from err
        else:
            if hello.digest != digest:
                raise _returned(host, hello)
            if not hello.on_trial:
                return
            if heard == started:
                ui.note(f"the new firmware runs; it is kept {STEADY_S} s after its start: leave the power on")
            heard = time.monotonic()
            if heard - started >= patience.trial_s:
                raise _lost(host, "it does not confirm the new one")
        time.sleep(patience.again_s)


def ask(host: str, port: int, key: str, digest: str) -> Hello:
    """Which firmware runs; if it is the one of this digest and on trial, it is confirmed. Raises FlashError."""
    upload = Upload(host, port)
    try:
        hello = upload.hello()
        if hello.on_trial and hello.digest == digest:
            upload.confirm(hello, key)
        return hello
    finally:
        upload.close()


def _returned(host: str, hello: Hello) -> FlashError:
    if not hello.digest:
        return FlashError(
            f"{host} does not report which firmware runs: the update cannot be confirmed",
            hint=f"a firmware that does not report it is kept by `wificnc login {host}` within {TRIAL_MINUTES} minutes",
        )
    return FlashError(
        f"the old firmware has returned: {host} runs {hello.digest}",
        hint="the new one has crashed, or the power was off before it was kept; run the same command again",
    )


def _lost(host: str, why: str) -> FlashError:
    return FlashError(
        f"{host} does not come back with the new firmware: {why}",
        hint=f"the old firmware returns {TRIAL_MINUTES} minutes after the start, unless you reach the new "
        f"one before: `wificnc login {host}`",
    )
