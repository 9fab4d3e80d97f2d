"""Run in a process of its own: bCNC's Sender class, without its windows, opens a port and streams a file."""

from __future__ import annotations

import builtins
import json
import os
import sys
import time
import traceback
from pathlib import Path

BCNC = Path(sys.argv[1]) / "bCNC"
for folder in ("", "lib", "plugins", "controllers"):
    sys.path.append(str(BCNC / folder))  # noqa: TID251  in bCNC's own Python
builtins._ = lambda text: text  # its translation

import Utils  # noqa: E402

Utils.loadConfiguration(True)

from CNC import CNC, WAIT  # noqa: E402
from Sender import NOT_CONNECTED, Sender  # noqa: E402

DEADLINE_S = 300.0


class Quiet(Sender):
    """What its main window adds for a run."""

    def disable(self) -> None:
        pass

    def enable(self) -> None:
        pass


def wait(sender: Quiet, what: str, ready: object) -> None:
    end = time.monotonic() + DEADLINE_S
    while not ready():  # type: ignore[operator]
        assert time.monotonic() < end, f"{what}: {CNC.vars['state']}"
        assert CNC.vars["state"] != NOT_CONNECTED
        time.sleep(0.02)


def idle(sender: Quiet) -> None:
    """Two reports from now on say idle: bCNC sets the state before the position in the same report."""
    for _report in range(2):
        CNC.vars["state"] = "not reported yet"
        wait(sender, "not idle", lambda: CNC.vars["state"] == "Idle")


def refused(port: str) -> None:
    """Run lines that a locked controller refuses. Prints what the operator sees."""
    sender = Quiet()
    assert sender.open(port, 115200)
    wait(sender, "no report", lambda: CNC.vars["state"] == "Idle")
    sender.initRun()
    for _line in range(40):
        sender.queue.put("G1 X1 F600\n")
    sender.queue.put((WAIT,))
    sender._runLines = 41
    shown: list[tuple[int, str]] = []

    def has_stopped() -> bool:
        while not sender.log.empty():
            shown.append(sender.log.get_nowait())
        return sender.queue.qsize() == 0 and any(kind == Sender.MSG_ERROR for kind, _text in shown)

    wait(sender, "it waits for an answer", has_stopped)
    sender.runEnded()
    sender.close()
    print(json.dumps([str(text) for _kind, text in shown]))


def main(port: str, file: str) -> None:
    sender = Quiet()
    assert sender.open(port, 115200)
    wait(sender, "no report", lambda: CNC.vars["state"] == "Idle")
    sender.mcontrol.viewSettings()
    wait(sender, "no settings", lambda: "grbl_100" in CNC.vars)
    sender.initRun()
    lines = Path(file).read_text().splitlines()
    for line in lines:
        if line:
            sender.queue.put(line + "\n")
    sender.queue.put((WAIT,))
    sender._runLines = sum(1 for line in lines if line) + 1
    wait(sender, "the job did not end", lambda: sender.queue.qsize() == 0 and sender._gcount >= sender._runLines)
    sender.runEnded()
    idle(sender)
    position = [CNC.vars[name] for name in ("mx", "my", "mz")]
    steps = CNC.vars["grbl_100"]
    messages = []
    while not sender.log.empty():
        messages.append(sender.log.get_nowait())
    sender.close()
    errors = [str(text) for kind, text in messages if kind == Sender.MSG_ERROR]
    print(json.dumps({"position": position, "steps_per_mm": float(steps), "errors": errors}))


try:
    (refused if len(sys.argv) == 3 else main)(*sys.argv[2:])
except BaseException:
    traceback.print_exc()
    os._exit(1)  # its threads would continue
