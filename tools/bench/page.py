"""The web page while a large job runs: frames a second, work of the main thread, from a click on Hold to the socket.

make bench-page            500,000 segments; SEGMENTS=100000 for fewer
"""

from __future__ import annotations

import argparse
import math
import os
import shutil
import statistics
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from playwright.sync_api import CDPSession, Page, sync_playwright
from wificnc.board.load import load_board
from wificnc.simulator.serve.options import Address, ServeOptions
from wificnc.simulator.serve.page import About, PageServer
from wificnc.simulator.serve.server import Server

from web.build import build_page

METHOD = """The page of `wificnc serve --http` in headless Chromium, 1440 x 900, software rendering. The job is streamed
in real time. Frames: intervals of requestAnimationFrame, 60 Hz here at most. Main thread: its processor time, which
other programs of a busy computer do not change (threadTicks of Chromium's Performance.getMetrics). Busy: long tasks, of
more than 50 ms of real time. Hold: from the time of the click to the WebSocket's send of `!`. The load of this
computer: {load:.1f} on {cores} cores. Nothing here is asserted."""
CHROMIUM = ("chromium", "chromium-browser", "google-chrome")
MACHINE = tuple(
    f"${base + axis}={value}" for base, value in ((100, 80), (110, 6000), (120, 500), (130, 0)) for axis in range(3)
)
SEGMENT_MM = 0.2
HOUR_MS = 3_600_000

# Counts of the page itself; the socket's send is seen before any script of the page runs.
WATCH = """
window.bench = { frames: [], busy: [], holds: [], clicked: 0 };
addEventListener("click", (event) => (bench.clicked = event.timeStamp), true);
const send = WebSocket.prototype.send;
WebSocket.prototype.send = function (data) {
  const bytes = typeof data === "string" ? data : new Uint8Array(data.buffer ?? data);
  const isHold = bytes.length === 1 && (bytes === "!" || bytes[0] === 33);
  send.call(this, data);
  if (isHold) bench.holds.push(performance.now() - bench.clicked);
};
new PerformanceObserver((list) => list.getEntries().forEach((task) => bench.busy.push(task.duration)))
  .observe({ type: "longtask" });
"""
FRAMES = """seconds => new Promise((resolve) => {
  const stamps = [];
  bench.busy.length = 0;
  const frame = (now) => {
    stamps.push(now);
    if (now - stamps[0] < seconds * 1000) requestAnimationFrame(frame);
    else resolve({ gaps: stamps.slice(1).map((at, i) => at - stamps[i]), busy: bench.busy.slice() });
  };
  requestAnimationFrame(frame);
})"""


def spiral(segments: int) -> str:
    """A job of short segments: a spiral, so that no two of them are alike and none can be merged."""
    lines = ["G21G90G94F3000"]
    radius = angle = 1.0
    for _ in range(segments):
        angle += SEGMENT_MM / radius
        radius = 1.0 + 0.4 * angle / (2 * math.pi)
        lines.append(f"G1X{radius * math.cos(angle):.3f}Y{radius * math.sin(angle):.3f}")
    return "\n".join(lines) + "\n"


def frames(page: Page, chromium: CDPSession, title: str, seconds: float) -> None:
    before = spent_s(chromium)
    found: dict[str, Any] = page.evaluate(FRAMES, seconds)
    spent = [100 * (now - then) / seconds for then, now in zip(before, spent_s(chromium), strict=True)]
    gaps = sorted(found["gaps"])
    late = gaps[int(0.99 * len(gaps))]
    busy = ", ".join(f"{task:.0f}" for task in sorted(found["busy"], reverse=True)[:5]) or "none"
    print(
        f"{title:26} {1000 / statistics.fmean(gaps):5.1f} frames/s; 99th percentile {late:5.1f} ms; main thread "
        f"{spent[0]:4.1f} % (script {spent[1]:.1f}, layout {spent[2]:.1f}); busy, ms: {busy}"
    )


def spent_s(chromium: CDPSession) -> list[float]:
    """Processor time of the page's main thread: all, scripts, layout and styles."""
    rows = {row["name"]: row["value"] for row in chromium.send("Performance.getMetrics")["metrics"]}
    return [rows["TaskDuration"], rows["ScriptDuration"], rows["LayoutDuration"] + rows["RecalcStyleDuration"]]


def holds(page: Page, count: int) -> None:
    state = page.locator("[data-test=state]")
    for _ in range(count):
        page.locator("[data-test=hold]").click()
        state.filter(has_text="Hold").wait_for()
        page.locator("[data-test=resume]").click()
        state.filter(has_text="Run").wait_for()
    took: list[float] = sorted(page.evaluate("bench.holds"))
    late = took[min(len(took) - 1, math.ceil(0.99 * len(took)) - 1)]
    print(f"{'Hold: click to socket':26} median {statistics.median(took):5.1f} ms; 99th percentile {late:5.1f} ms; "
          f"worst {took[-1]:5.1f} ms, of {len(took)}")  # fmt: skip


def measure(page: Page, job: Path, segments: int, seconds: float, count: int) -> None:
    page.locator("[data-test=state]", has_text="Idle").wait_for()
    chromium = page.context.new_cdp_session(page)
    chromium.send("Performance.enable", {"timeDomain": "threadTicks"})
    page.click("#tab-job")
    began = time.perf_counter()
    page.locator("[data-test=job-file]").set_input_files(job)
    page.locator("[data-test=job-time]").wait_for()
    print(f"{'preflight':26} {time.perf_counter() - began:5.1f} s for {segments:,} segments, in its worker")
    frames(page, chromium, "Job, at rest", seconds)
    page.click("[data-test=job-start]")
    page.locator("[data-test=state]", has_text="Run").wait_for()
    frames(page, chromium, "Job, running, from above", seconds)
    page.get_by_role("button", name="3-D").click()
    frames(page, chromium, "Job, running, in 3-D", seconds)
    holds(page, count)
    page.click("#tab-control")
    frames(page, chromium, "Control, running", seconds)
    page.evaluate("bench.holds.length = 0")
    holds(page, count)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--segments", type=int, default=500_000)
    parser.add_argument("--seconds", type=float, default=10.0, help="of each measurement of frames")
    parser.add_argument("--holds", type=int, default=100)
    options = parser.parse_args()
    program = next(filter(None, map(shutil.which, CHROMIUM)), None)
    if program is None:
        print("There is no Chromium on this computer: apt-get install chromium", file=sys.stderr)
        return 1
    folder = build_page()[0]
    print(METHOD.format(load=os.getloadavg()[0], cores=os.cpu_count()))
    serve = ServeOptions(board=load_board("host"), tcp=Address("127.0.0.1", 0), settings=MACHINE)
    with TemporaryDirectory() as files, Server(serve) as server:
        about = About("benchmark", "0", "host", len(server.options.board.axes))
        job = Path(files) / "spiral.nc"
        job.write_text(spiral(options.segments), encoding="ascii")
        with PageServer(Address("127.0.0.1", 0), server.tcp, about, folder) as served, sync_playwright() as playwright:
            chromium = playwright.chromium.launch(executable_path=program, args=["--no-sandbox"])
            page = chromium.new_page(viewport={"width": 1440, "height": 900}, locale="en-GB")
            page.set_default_timeout(HOUR_MS)
            page.add_init_script(WATCH)
            page.goto(served.url)
            measure(page, job, options.segments, options.seconds, options.holds)
            chromium.close()
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
