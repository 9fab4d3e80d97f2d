"""Skipped tests where none may be: with WIFICNC_NO_SKIPS=1 (as .ci/run sets it) a skip is a failure.

CI installs every tool that a test needs, so a test that does not find its tool says that CI is broken. What may be
skipped there is listed here, with the reason.
"""

from __future__ import annotations

import os
import re
from collections import Counter
from collections.abc import Iterable

VARIABLE = "WIFICNC_NO_SKIPS"

# what the skip says -> why no installation can help
ALLOWED = {
    r"this kernel has no netem": "tc netem is a module of the kernel, and CI brings no kernel",
    r"unshare, ip or tc is not here": "a container may forbid network namespaces; the proxy's tests do the same",
    r"no namespace of users and networks here": "a container may forbid them; the cable's tests use sockets",
    r"127\.0\.0\.1 is this computer's only address": "a container may have loopback alone",
    r"root reads everything": "CI runs as root, and no file is forbidden to root",
    r"no more than \d+ open files here": "the limit is the container's",
    r"make test-chip$": "a part of that longer run, which is no part of CI",
    r"this machine's compiler is newer than those we know": "then its warnings are no errors yet",
    r"is not in the image: nothing uses it": "the linker has left it out; there is nothing to test",
    r"cannot be installed:|was not installed within": "foreign registries; tests/senders fails itself where CI=true",
    r"measures with /proc|Linux tells it there|needs many loopback addresses|no /dev/full": "another system than Linux",
}


def is_forbidden(reason: str) -> bool:
    """This skip is a failure here."""
    if os.environ.get(VARIABLE, "") in ("", "0"):
        return False
    return not any(re.search(pattern, reason) for pattern in ALLOWED)


def closing_lines(reasons: Iterable[str]) -> list[str]:
    """What was skipped, the most first; most reasons name the package that brings it back."""
    counted = Counter(reason.removeprefix("Skipped: ").splitlines()[0] for reason in reasons)
    return [f"{count} skipped: {reason}" for reason, count in counted.most_common()]


def complaint(reason: str) -> str:
    """What the failed test says."""
    return (
        f"skipped where no test may be ({VARIABLE}): {reason}\n"
        "Install what is missing; tests/support/skips.py lists what may be skipped."
    )
