"""Trace files of a simulation: CSV, VCD, and NPZ (numpy's format, written without numpy)."""

from __future__ import annotations

import zipfile
from array import array
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from wificnc.errors import UserError
from wificnc.simulator.library import AXES, Simulation

TRACE_SUFFIXES = (".csv", ".vcd", ".npz")
RECORD = 16  # u64 t_ns, u8 step_mask, u8 dir_mask, u16 duty, 4 bytes padding
CHUNK = RECORD << 16


@dataclass(frozen=True)
class TraceFile:
    """A trace to be written: path is the user's, staged is where it grows until it is whole."""

    path: Path
    staged: Path
    names: tuple[str | None, ...]  # step lines X..C, then direction lines X..C; None = the board has none

    @property
    def suffix(self) -> str:
        return self.path.suffix.lower()

    @property
    def raw_path(self) -> Path:
        """The file that the host library writes."""
        return self.staged.with_name(self.staged.name + ".raw") if self.suffix == ".npz" else self.staged

    def attach(self, sim: Simulation) -> None:
        """Let the simulation write. Raises UserError."""
        try:
            if self.suffix == ".csv":
                sim.trace_csv(self.raw_path)
            elif self.suffix == ".vcd":
                sim.trace_vcd(self.raw_path, self.names)
            else:
                sim.trace_raw(self.raw_path)
        except OSError as err:
            raise UserError(f"cannot write the trace {self.path}: {err.strerror}") from err

    def complete(self) -> None:
        """What is left to do once the simulation has closed its file."""
        if self.suffix == ".npz":
            raw_to_npz(self.raw_path, self.staged)

    def clean(self) -> None:
        """Remove what is not the result."""
        if self.raw_path != self.staged:
            self.raw_path.unlink(missing_ok=True)


def signal_names(pins: Mapping[str, str], axes: str) -> tuple[str | None, ...]:
    """Signal and pin in one word that every VCD reader takes: step_x_GPIO1."""

    def name(kind: str, axis: str) -> str | None:
        signal = f"{kind}_{axis.lower()}"
        if axis not in axes:
            return None
        return f"{signal}_{pins[signal]}" if signal in pins else signal

    return tuple(name(kind, axis) for kind in ("step", "dir") for axis in AXES)


def raw_to_npz(raw: Path, npz: Path) -> None:
    """16-byte records -> arrays t_ns (u64), step_mask and dir_mask (u8), and duty (u16), as numpy.load() reads them."""
    count = raw.stat().st_size // RECORD
    columns: tuple[tuple[str, str, Callable[[bytes], bytes]], ...] = (
        ("t_ns", "<u8", _times),
        ("step_mask", "|u1", lambda chunk: chunk[8::RECORD]),
        ("dir_mask", "|u1", lambda chunk: chunk[9::RECORD]),
        ("duty", "<u2", lambda chunk: array("H", chunk)[5::8].tobytes()),
    )
    with zipfile.ZipFile(npz, "w") as archive:
        for name, dtype, take in columns:
            entry = zipfile.ZipInfo(f"{name}.npy", date_time=(1980, 1, 1, 0, 0, 0))
            with archive.open(entry, "w", force_zip64=True) as out:
                out.write(npy_header(dtype, count))
                for chunk in _chunks(raw):
                    out.write(take(chunk))


def npy_header(dtype: str, count: int) -> bytes:
    """Header of a one-dimensional .npy file, format 1.0: magic, version, length, a dict padded to 64 bytes."""
    text = f"{{'descr': '{dtype}', 'fortran_order': False, 'shape': ({count},), }}"
    prefix = 10
    padded = text + " " * (-(prefix + len(text) + 1) % 64) + "\n"
    return b"\x93NUMPY\x01\x00" + len(padded).to_bytes(2, "little") + padded.encode("ascii")


def _times(chunk: bytes) -> bytes:
    return array("Q", chunk)[::2].tobytes()


def _chunks(path: Path) -> Iterator[bytes]:
    with path.open("rb") as file:
        while chunk := file.read(CHUNK):
            yield chunk
