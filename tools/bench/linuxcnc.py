"""Measure LinuxCNC's component in halrun, at a served controller: python -m bench.linuxcnc [--seconds N]."""

from __future__ import annotations

import argparse
import os
import subprocess
import tempfile
import textwrap
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
from wificnc.board.load import load_board
from wificnc.build.checkout import checkout_root
from wificnc.linuxcnc.source import FILE_NAME, PROGRAM, build_command, component_source
from wificnc.simulator.serve.options import ServeOptions
from wificnc.simulator.serve.server import Server

from bench.halrun import isolated

# the ports are fixed: every run has an address of its own
ADDRESS = f"127.58.{os.getpid() >> 8 & 0xFF}.{os.getpid() & 0xFF or 1}"
SETTINGS = tuple(f"${base + ax}={value}" for base, value in ((100, 200), (110, 6000), (120, 1000)) for ax in range(3))
SINE_HZ, SINE_MM = 0.5, 20.0
SERVO_S = 0.001
BEGINS_S = 5.0  # of halrun, until all moves
INTERVALS_MS, ENCODERS = (10, 100), (0, 4096)

HEAD = (
    "Three joints at 200 steps/mm follow a sine of {mm:g} mm at {hz:g} Hz, {seconds:g} s long; controller, LinuxCNC's "
    "1 ms servo thread without real time, and the component are on this computer. CPU: the scheduler's time on a "
    "processor (/proc/PID/schedstat). Lag: phase of the feedback's sine against the command's, both as the servo "
    "thread sees them; 100 ms of it are the queue, the rest the interval of reports ($76)."
)
HAL = """loadrt siggen num_chan=1
loadrt limit3 count=1
loadrt integ count=1
loadrt sampler depth=1000,4000 cfg=ffffs,ff
loadusr -Wn wificnc {program} --address {address} --joints 3
loadrt threads name1=servo period1=1000000
addf siggen.0.update servo
addf limit3.0 servo
addf integ.0 servo
addf sampler.0 servo
addf sampler.1 servo
setp siggen.0.frequency {hz}
setp siggen.0.amplitude 0
setp limit3.0.maxv 90
setp limit3.0.maxa 900
setp integ.0.in 1
setp sampler.1.enable 0
setp wificnc.joint.0.scale 200
setp wificnc.joint.1.scale 200
setp wificnc.joint.2.scale 200
net wanted siggen.0.sine => limit3.0.in
net command limit3.0.out => sampler.0.pin.0 sampler.0.pin.1 sampler.0.pin.2 sampler.1.pin.0
net time integ.0.out => sampler.0.pin.3
net feedback wificnc.joint.0.position-fb => sampler.1.pin.1
start
loadusr -w sleep 1
setp wificnc.enable 1
loadusr -w sleep 1
setp siggen.0.amplitude {mm}
loadusr -w sleep 2
setp sampler.1.enable 1
loadusr -w halsampler -c 1 -n {samples} {folder}/samples
getp wificnc.underruns
getp wificnc.fault
"""


def main() -> int:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=10.0, help="of motion, each time")
    asked = parser.parse_args()
    print(f"{os.cpu_count()} processors, load {os.getloadavg()[0]:.1f}")
    print(textwrap.fill(HEAD.format(mm=SINE_MM, hz=SINE_HZ, seconds=asked.seconds), 120))
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        folder.chmod(0o777)
        (folder / FILE_NAME).write_text(component_source(checkout_root()), encoding="utf-8")
        subprocess.run(build_command("compile", str(folder / FILE_NAME)), check=True, capture_output=True)
        for counts in ENCODERS:
            for interval_ms in INTERVALS_MS:
                print(measure(folder, interval_ms, counts, asked.seconds))
    return 0


def measure(folder: Path, interval_ms: int, encoder_counts: int, seconds: float) -> str:
    """One run; its figures on one line."""
    values = {"program": folder / PROGRAM, "address": ADDRESS, "hz": SINE_HZ, "mm": SINE_MM, "folder": folder}
    (folder / "bench.hal").write_text(HAL.format(**values, samples=round(seconds / SERVO_S)))
    settings = (*SETTINGS, f"$76={interval_ms}", f"$88={encoder_counts}")
    argv = isolated("halrun", "-f", str(folder / "bench.hal"))
    environment = {**os.environ, "HOME": str(folder)}
    with Server(ServeOptions(board=load_board("host"), wmc3=ADDRESS, settings=settings)), ThreadPoolExecutor() as pool:
        share = pool.submit(processor_share, seconds - 2)
        run = subprocess.run(argv, env=environment, capture_output=True, text=True, timeout=seconds + 60, check=True)
    underruns, fault = run.stdout.split()[-2:]
    words = "with an encoder" if encoder_counts else "without an encoder"
    lag_ms = 1e3 * lag_s(np.loadtxt(folder / "samples", usecols=(0, 1)))
    said = f"reports every {interval_ms:3} ms, {words}: CPU {100 * share.result():.2f} %, lag {lag_ms:.0f} ms, "
    return said + f"{underruns} underruns{', FAULT' if fault == 'TRUE' else ''}"


def processor_share(seconds: float) -> float:
    """Of one processor, that the component takes while it moves."""
    time.sleep(BEGINS_S)
    wanted = f"{PROGRAM}\0--address\0{ADDRESS}".encode()
    found = [path.parent for path in Path("/proc").glob("[0-9]*/cmdline") if wanted in _read(path)]
    before_ns, begun = int(_read(found[0] / "schedstat").split()[0]), time.monotonic()
    time.sleep(seconds)
    return (int(_read(found[0] / "schedstat").split()[0]) - before_ns) / 1e9 / (time.monotonic() - begun)


def _read(path: Path) -> bytes:
    """Processes end while one looks at them."""
    try:
        return path.read_bytes()
    except OSError:
        return b""


def lag_s(rows: np.ndarray) -> float:
    """By least squares. @param rows  command and feedback of each servo period"""
    angle = 2 * np.pi * SINE_HZ * SERVO_S * np.arange(len(rows))
    base = np.column_stack([np.sin(angle), np.cos(angle), np.ones_like(angle)])
    command, feedback = (np.linalg.lstsq(base, rows[:, column], rcond=None)[0] for column in (0, 1))
    behind = np.arctan2(command[1], command[0]) - np.arctan2(feedback[1], feedback[0])
    return float(behind % (2 * np.pi)) / (2 * np.pi * SINE_HZ)


if __name__ == "__main__":
    raise SystemExit(main())
