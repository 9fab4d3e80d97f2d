"""How much a browser loads before a machine can be run: a controller serves it by WiFi."""

from __future__ import annotations

from collections.abc import Callable

from playwright.sync_api import Request
from web_fixture import Watched
from wificnc.serve.page import PageServer
from wificnc.serve.server import Server

FIRST_LOAD_BYTES = 80 * 1024  # with the heads of the answers


def test_the_first_load_is_small(
    serve_page: Callable[..., tuple[Server, PageServer]], watched: Callable[..., Watched]
) -> None:
    """The whole page in use: Control, Terminal and Settings, connected. The rest comes with its first use."""
    _, served = serve_page()
    loaded: list[Request] = []
    context = watched()
    context.context.on("requestfinished", lambda request: loaded.append(request))
    page = context.page(served.url)
    page.locator("[data-test=state]", has_text="Idle").wait_for()
    for tab in ("job", "terminal", "settings", "control"):
        page.click(f"#tab-{tab}")
    sizes = {request.url: request.sizes() for request in loaded}
    total = sum(size["responseBodySize"] + size["responseHeadersSize"] for size in sizes.values())
    assert len(sizes) >= 4
    assert 40 * 1024 < total <= FIRST_LOAD_BYTES, sizes
