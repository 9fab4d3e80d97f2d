"""The parts of targets/sim that the product does not call from Python: measure.h, trace_write.h, sim_text.h."""

from __future__ import annotations

import ctypes
from collections.abc import Iterable, Sequence
from ctypes import POINTER, byref, c_char_p, c_double, c_int, c_void_p
from pathlib import Path

import numpy as np
from c_library import CONSUMER, EVENT
from layouts import HOST
from wificnc.simulator.library import AXIS_COUNT, SAMPLE_DTYPE, PathSample

RAPID = 0x01
AXES = range(AXIS_COUNT)

Measured = HOST.struct("measured")
SimText = HOST.struct("sim_text")


def events(rows: Iterable[Sequence[int]]) -> np.ndarray:
    """Rows of (t, step_mask, dir_mask[, flags[, dwells]])."""
    return np.array([(*row, *(0,) * (6 - len(row))) for row in rows], dtype=EVENT)


def axis_events(ticks: np.ndarray, axis: int = 0, negative: bool = False, flags: int = 0) -> np.ndarray:
    out = np.zeros(len(ticks), dtype=EVENT)
    out["t"], out["step"], out["dir"], out["flags"] = ticks, 1 << axis, int(negative) << axis, flags
    return out


def measure(
    library: ctypes.CDLL,
    trace: np.ndarray,
    hz: int,
    *,
    begin: int = 0,
    steps_per_mm: float = 1.0,
    sample_ms: float | None = None,
    expected_steps_s2: float | None = None,
    chunk: int = 4096,
) -> tuple[Measured, np.ndarray]:
    """Figures and samples of a trace that comes in chunks."""
    handle = library.measure_create(hz)
    library.measure_begin(handle, begin, (c_double * AXIS_COUNT)(*[steps_per_mm] * AXIS_COUNT))
    for axis in AXES:
        if expected_steps_s2 is not None:
            library.measure_expect_accel(handle, axis, expected_steps_s2)
    if sample_ms is not None:
        library.measure_sample_every(handle, sample_ms)
    for at in range(0, len(trace), chunk):
        part = np.ascontiguousarray(trace[at : at + chunk])
        library.measure_events(handle, part.ctypes.data, len(part))
    end = int(trace["t"][-1]) if len(trace) else begin
    library.measure_end(handle, end, int(trace["dwells"][-1]) if len(trace) else 0)
    library.measure_end(handle, end, 0)  # once is enough
    out = Measured()
    library.measure_result(handle, byref(out))
    first = POINTER(PathSample)()
    count = library.measure_samples(handle, byref(first))
    raw = ctypes.string_at(first, count * ctypes.sizeof(PathSample)) if count else b""
    library.measure_destroy(handle)
    return out, np.frombuffer(raw, dtype=SAMPLE_DTYPE)


def write_trace(library: ctypes.CDLL, trace: np.ndarray, path: Path, hz: int, **vcd: object) -> int:
    """Run a trace through the writer of the path's suffix. Returns the errno of closing."""
    error = c_int(-1)
    where = str(path).encode()
    if path.suffix == ".vcd":
        names = (c_char_p * 12)(*(n.encode() if n else None for n in vcd["names"]))
        writer = library.trace_vcd_open(where, hz, vcd["pulse_ns"], vcd["setup_ns"], names, byref(error))
    else:
        opener = library.trace_csv_open if path.suffix == ".csv" else library.trace_raw_open
        writer = opener(where, hz, byref(error))
    if not writer:
        return error.value
    consume = CONSUMER(ctypes.cast(writer, POINTER(c_void_p))[0])  # struct trace_writer begins with it
    for at in range(0, len(trace), 4096):
        part = np.ascontiguousarray(trace[at : at + 4096])
        consume(writer, part.ctypes.data, len(part))
    return library.trace_writer_close(writer)


def job_lines(library: ctypes.CDLL, text: bytes) -> tuple[list[bytes], list[int], int, int]:
    """sim_text_make(): wire lines, their numbers, lines of the file, % lines."""
    out = SimText()
    assert library.sim_text_make(byref(out), text, len(text)) == 0
    wire = ctypes.string_at(out.bytes, out.size)
    numbers = list(out.line_number[: out.line_count])
    counts = (out.file_lines, out.percent_lines)
    library.sim_text_free(byref(out))
    assert wire.endswith(b"\n") or not wire
    return wire.split(b"\n")[:-1], numbers, *counts


def program_end(library: ctypes.CDLL, text: bytes) -> object:
    """Where sim_text_make() ends the program."""
    out = SimText()
    assert library.sim_text_make(byref(out), text, len(text)) == 0
    end = type(out.end).from_buffer_copy(out.end)
    library.sim_text_free(byref(out))
    return end
