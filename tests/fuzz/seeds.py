"""Random inputs of a harness from seeds, without libFuzzer: python tests/fuzz/seeds.py interleave --seconds 3600.

As many processes as processors, each with its own seeds. Findings go to build/fuzz/seeds/NAME/seed-N; the program that
replays one is build/fuzz/seeds/NAME/replay.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys

from harnesses import HERE, NAMES, build_harness
from wificnc.build.checkout import checkout_root

APART = 1_000_000_000  # between the seeds of two processes


def main() -> int:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("name", choices=NAMES)
    parser.add_argument("--seconds", type=int, default=60)
    parser.add_argument("--seed", type=int, default=1, help="the first one")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    asked = parser.parse_args()
    folder = checkout_root() / "build" / "fuzz" / "seeds" / asked.name
    folder.mkdir(parents=True, exist_ok=True)
    build_harness(asked.name, folder / "replay", "release", HERE / "replay.c")
    program = build_harness(asked.name, folder / "seeds", "release", HERE / "seeds.c")
    running = [
        subprocess.Popen([program, str(asked.seed + n * APART), str(asked.seconds), folder]) for n in range(asked.jobs)
    ]
    codes = [process.wait() for process in running]
    return 1 if any(codes) else 0


if __name__ == "__main__":
    sys.exit(main())
