"""A controller that restarted in mid-job, by its start id."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import pytest
from sender import Nobody, Notes
from wificnc.connection.client import Client
from wificnc.connection.grbl import Status, parse
from wificnc.job.run import RESTARTED, End, JobRun


def report(start_id: str) -> Status:
    field = f"|Start:{start_id}" if start_id else ""
    status = parse(f"<Run|MPos:1.000,0.000,0.000|FS:0,0{field}>")
    assert isinstance(status, Status)
    return status


@pytest.mark.parametrize(
    ("starts", "lost"),
    [(["", ""], False), (["1", "", "1"], False), (["1", "2"], True), (["", "1", "", "2"], True), (["1", ""], False)],
)
def test_another_start_ends_the_job(starts: list[str], lost: bool) -> None:
    client = cast(Client, SimpleNamespace(now=lambda: SimpleNamespace(status=status, mpos=(1.0,), state="Run")))
    run = JobRun(client, [], Notes(), Nobody())
    for start_id in starts:
        status = report(start_id)
        run._notice_restart(status)
    assert run._end == ((End.RESET, RESTARTED) if lost else None)
