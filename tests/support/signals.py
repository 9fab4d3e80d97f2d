"""Signals of programs under test: usual ones, or ignored ones, whatever the tests themselves have inherited.

`nohup` starts programs that ignore SIGHUP, and a shell without job control starts programs in the background that
ignore SIGINT; what those start inherits that.
"""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager


@contextmanager
def _handled(handler: signal.Handlers) -> Iterator[None]:
    before = {number: signal.signal(number, handler) for number in (signal.SIGINT, signal.SIGHUP)}
    try:
        yield
    finally:
        for number, handled in before.items():
            signal.signal(number, handled)


def usual_signals() -> AbstractContextManager[None]:
    """A program that starts in this block ends by Ctrl-C and with its terminal."""
    return _handled(signal.SIG_DFL)


def ignored_signals() -> AbstractContextManager[None]:
    """A program that starts in this block has been started by nohup, in the background."""
    return _handled(signal.SIG_IGN)
