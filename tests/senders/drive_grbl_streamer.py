"""Run in a process of its own: grbl-streamer connects to a port and streams a file. Prints what it saw as JSON.

It reads settings in the form of Grbl 0.9 only, `$0=10 (step pulse, usec)`; so it never knows those of a Grbl 1.1."""

from __future__ import annotations

import json
import os
import sys
import threading
import traceback

from grbl_streamer import GrblStreamer

HANG_S = 300.0  # it hangs, at any load; what the tests share is out of reach here


def main(port: str, file: str) -> None:
    done = {name: threading.Event() for name in ("on_boot", "on_gcode_parser_stateupdate", "on_job_completed")}
    started, rests = threading.Event(), threading.Event()
    modes: list[str] = []
    errors: list[str] = []

    def callback(event: str, *data: object) -> None:
        if event in done:
            done[event].set()
        elif event == "on_stateupdate":
            modes.append(str(data[0]))
            if started.is_set() and modes[-1] == "Idle" and "Run" in modes:
                rests.set()
        elif event in ("on_error", "on_alarm"):
            errors.append(f"{event} {data}")

    streamer = GrblStreamer(callback)
    streamer.setup_logging()
    streamer.cnect(port, 115200)
    assert done["on_boot"].wait(HANG_S), "no banner"
    streamer.poll_start()
    assert done["on_gcode_parser_stateupdate"].wait(HANG_S), "no parser state"
    streamer.load_file(file)
    done["on_job_completed"].clear()  # said once at the banner
    started.set()
    streamer.job_run()
    assert done["on_job_completed"].wait(HANG_S), f"the job did not end: {streamer.cmode} {streamer.cmpos} {errors}"
    assert rests.wait(HANG_S), f"it does not come to rest: {modes}"
    result = {"position": list(streamer.cmpos), "errors": errors}
    streamer.disconnect()
    print(json.dumps(result))


def refused(port: str) -> None:
    """Run a line that a locked controller refuses. Prints the errors that it reports."""
    ended = threading.Event()
    errors: list[str] = []

    def callback(event: str, *data: object) -> None:
        if event == "on_error":
            errors.append(str(data[0]))
            ended.set()

    streamer = GrblStreamer(callback)
    streamer.setup_logging()
    streamer.cnect(port, 115200)
    streamer.write("G1 X1 F600\nG1 X2\n")
    streamer.job_run()
    assert ended.wait(HANG_S), "it waits for an answer"
    print(json.dumps(errors), flush=True)
    os._exit(0)  # disconnect() waits for a controller that has booted


try:
    (refused if len(sys.argv) == 2 else main)(*sys.argv[1:])
except BaseException:
    traceback.print_exc()
    os._exit(1)  # its threads would continue
