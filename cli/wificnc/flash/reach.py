"""A new firmware stays only if someone who may command reaches it: targets/esp32/net/update_trial.h."""

from __future__ import annotations

import time
from urllib.parse import quote

from wificnc.errors import FlashError, LinkError, RefusedError
from wificnc.link.transport import open_transport

TELNET_PORT = 23
RESTART_S = 3.0  # the old firmware has ended by then
PATIENCE_S = 60.0  # its start, and the way into a network
AGAIN_S = 1.0
TRIAL_MINUTES = 5


def wait_until_reached(host: str, key: str, port: int = TELNET_PORT, patience_s: float = PATIENCE_S) -> None:
    """Log in to the controller that restarts, which confirms its new firmware.

    Raises FlashError when it does not come back.
    """
    name = f"[{host}]" if ":" in host else host
    target = f"tcp://:{quote(key, safe='')}@{name}:{port}"
    deadline = time.monotonic() + patience_s
    while True:
        try:
            open_transport(target).close()
            return
        except (LinkError, RefusedError) as err:
            if time.monotonic() >= deadline:
                raise FlashError(
                    f"{host} does not come back with the new firmware: {err.message}",
                    hint=f"the old firmware returns {TRIAL_MINUTES} minutes after the start, unless you reach the new "
                    f"one before: `wificnc login {host}`",
                ) from err
        time.sleep(AGAIN_S)
