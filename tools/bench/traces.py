"""Jobs in the PIC32MZ's real image and in the host's simulation: `make chip-traces`, FILES="a.nc b.nc" for others."""

from __future__ import annotations

import argparse
import time
from pathlib import Path

from wificnc.board.load import load_board
from wificnc.errors import UserError
from wificnc.simulator.run import SimOptions
from wificnc_chips import ChipResult, Pace, run_on_chip

ROOT = Path(__file__).resolve().parents[2]
BOARD = "pic32mz2048efh100"
SETTINGS = tuple(f"${base + axis}={value}" for base, value in ((110, 5000), (120, 500)) for axis in range(4))
METHOD = """
Each job in the virtual chip at 115200 baud, times --wire; its CPU times --cpu. Compared with the host's simulation of
the same board and settings: `exact`: the same axes step in the same directions at every event. `path`: each axis makes
the same steps in the same order, and at some events others step beside it. `other`: neither."""


def verdict(result: ChipResult) -> str:
    if result.first_difference is None:
        return "exact"
    return f"{'path' if result.same_path else 'other'} from event {result.first_difference:,}"


def main() -> int:
    """Exit code 1 when a trace is not exact."""
    parser = argparse.ArgumentParser()
    parser.add_argument("files", nargs="*", type=Path)
    parser.add_argument("--wire", type=int, default=1)
    parser.add_argument("--cpu", type=int, default=1)
    words = parser.parse_args()
    board, exact = load_board(BOARD), True
    print(METHOD + "\n")
    for file in words.files or sorted((ROOT / "examples").glob("*.nc")):
        begin = time.process_time()
        try:
            options = SimOptions(file=file, board=BOARD, settings=SETTINGS)
            result = run_on_chip(board, options, list(SETTINGS), pace=Pace(words.wire, words.cpu))
        except UserError as err:
            print(f"{file.name:<32} {err.message}", flush=True)
            exact = False
            continue
        took = f"{result.seconds:8.1f} s of motion, {time.process_time() - begin:5.0f} s of this computer"
        print(f"{file.name:<32} {result.events:>10,} events {took}  {verdict(result)}", flush=True)
        exact &= result.first_difference is None
    return 0 if exact else 1


if __name__ == "__main__":
    raise SystemExit(main())
