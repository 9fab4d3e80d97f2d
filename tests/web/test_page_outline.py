"""Before the first cut: around the bounds of the job with the tool up, and a start in its middle."""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest
from console_page import Console, load, square
from playwright.sync_api import expect

pytestmark = pytest.mark.slow  # opens a browser, for which the page is built


def test_the_outline_is_run_and_a_job_starts_at_a_line(socket_link: Callable[..., Console]) -> None:
    console = socket_link(speed=4.0)
    load(console, square(3, side=4.0))
    console.by("frame").click()
    console.by("frame-feed_mm_min").fill("3000")
    lines = (console.by("frame-lines").text_content() or "").splitlines()
    assert (lines[0], lines[-2:]) == ("$J=G21G91Z5F600", ["$J=G53G21G90X0Y0F3000", "$J=G21G91Z-5F600"])
    corners = [tuple(map(float, re.findall(r"[XY](-?[\d.]+)", line))) for line in lines[1:-2]]
    assert corners == [pytest.approx(at, abs=0.03) for at in ((0, 0), (4, 0), (4, 4), (0, 4), (0, 0))]
    console.by("frame-start").click()
    expect(console.by("frame-start")).to_have_count(0)
    expect(console.by("frame-stop")).to_have_count(0)
    console.is_in("Idle")
    console.by("resume-line").fill("9")
    console.by("resume-line").blur()
    console.by("resume-plan").click()
    expect(console.by("resume-preamble")).to_contain_text("M3S1000")
    console.page.get_by_role("button", name="Cancel").click()
    console.tab("control")
    console.stands_at(X=0, Y=0, Z=0)


def test_a_typed_line_holds_for_one_start(socket_link: Callable[..., Console]) -> None:
    """Later the field has the line that the page suggests again, and not that of the run before."""
    console = socket_link(speed=4.0)
    load(console, "G21G90F600\n" + "".join(f"G1X{n}\n" for n in range(1, 9)))
    line = console.by("resume-line")
    line.fill("6")
    line.blur()
    console.by("resume-plan").click()
    console.by("resume-start").click()
    expect(console.page.get_by_text("The job is finished")).to_be_visible()
    expect(line).to_have_value("1")
