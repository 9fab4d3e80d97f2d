"""A CheckReport in words and figures."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from wificnc.simulator.check.finding import Finding, Severity
from wificnc.simulator.check.judge import Extent
from wificnc.simulator.check.run import CheckReport


def report_json(report: CheckReport) -> dict[str, Any]:
    """The document of --json. The keys are a contract with scripts."""
    result = report.result
    return {
        "file": result.file,
        "machine": report.machine,
        "board": report.board,
        "ok": report.count(Severity.ERROR) == 0,
        "lines": result.lines,
        "job_time_s": result.job_time_s,
        "cutting_time_s": result.cutting_time_s,
        "rapid_time_s": result.rapid_time_s,
        "max_step_rate_hz": result.max_step_rate_hz,
        "step_rate_limit_hz": report.step_rate_limit_hz,
        "work_zero_known": report.work_zero,
        "extent": {extent.axis: _extent_json(extent, report.work_zero) for extent in report.extents},
        "tool_changes": [asdict(change) for change in result.tool_changes],
        "findings": [_finding_json(finding) for finding in report.findings],
    }


def _extent_json(extent: Extent, zero_known: bool) -> dict[str, Any]:
    zero = None if zero_known else extent.zero_mm
    return {
        "min_mm": extent.min_mm,
        "max_mm": extent.max_mm,
        "travel_mm": extent.travel_mm,
        "work_zero_mm": list(zero) if zero else None,
    }


def _finding_json(finding: Finding) -> dict[str, Any]:
    return {
        "kind": finding.kind,
        "severity": finding.severity.value,
        "first_line": finding.first_line,
        "last_line": finding.last_line,
        "message": finding.message,
        "hint": finding.hint,
        "time_s": finding.time_s,
    }


EXTENT_COLUMNS = ("axis", "from mm", "to mm", "travel", "work zero may lie at")


def extent_rows(report: CheckReport) -> list[tuple[str, ...]]:
    """A row for each axis that moves."""
    rows: list[tuple[str, ...]] = []
    for extent in report.extents:
        travel = "" if extent.travel_mm is None else f"{extent.travel_mm:g}"
        zero = None if report.work_zero else extent.zero_mm
        places = f"{zero[0]:.3f} to {zero[1]:.3f}" if zero else ""
        rows.append((extent.axis, f"{extent.min_mm:.3f}", f"{extent.max_mm:.3f}", travel, places))
    return rows


def finding_line(file: str, finding: Finding) -> str:
    """job.nc:17-204: warning: F6000 is never reached ..."""
    where = f"{file}:{finding.lines}" if finding.first_line else file
    return f"{where}: {finding.severity.value}: {finding.message}"
