"""No `$` setting can lock its user out: whatever its value, it is taken back by the link over which it was set.

That is why settings need no trial as the network and the pins do (docs/web.md). Each setting goes to both ends of its
range, with all inputs of the machine low and all of them high, and the controller restarts with it. Then a reset and
the `$` line with the value before must be enough."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from grbl_host import Grbl
from wificnc.tables.settings import Setting, load_settings

ROOT = Path(__file__).resolve().parents[2]
# Networks, the page, its login, updates and pins.
NETWORK = ("targets/net", "targets/esp32/net", "targets/esp32/main", "targets/pc/page.c", "core/device")
SETTING_READ = re.compile(r"settings(?:\.|->)([a-z_0-9]+)")
ROWS = load_settings().setting
ALL = pytest.mark.parametrize("row", ROWS, ids=lambda row: row.name)
# An e-stop or a hold button that is pressed and an open door are no settings.
INPUTS = ("limit-x", "limit-y", "limit-z", "probe", *(f"input-{n}" for n in range(4)))
RESET = "\x18"


def machine(store: Path, high: bool) -> Grbl:
    found = Grbl(axes=6, store=store, encoder=True, pump=True, spindle_bus=True, drivers=True)
    for name in INPUTS:
        found.input(name, high)
    found.send("")
    return found


def value(found: Grbl, number: int) -> str:
    row = re.search(rf"^\${number}=(\S+)", found.send("$$\n"), re.MULTILINE)
    assert row, f"$$ lists ${number}"
    return row[1]


def ends(row: Setting) -> list[float]:
    if row.type == "bool":
        return [0.0, 1.0]
    # Points of the laser's curve ascend: most of their ranges is refused.
    between = [float(row.default) - 15.0, float(row.default) + 15.0] if row.name.startswith("laser_curve") else []
    return [float(row.min), float(row.max), *between]


@ALL
@pytest.mark.parametrize("high", [False, True], ids=["low", "high"])
def test_a_setting_is_taken_back_over_its_own_link(tmp_path: Path, row: Setting, high: bool) -> None:
    taken = 0
    for end in ends(row):
        store = tmp_path / f"store-{end}"
        with_it = machine(store, high)
        before = value(with_it, row.number)
        taken += "ok\r\n" in with_it.send(f"${row.number}={end}\n")
        with_it.close()
        again = machine(store, high)
        again.send(RESET)
        assert "ok\r\n" in again.send(f"${row.number}={before}\n"), f"${row.number}={end}"
        assert value(again, row.number) == before
        again.close()
    assert taken, "neither end of its range was accepted, so that nothing was tried"


def fields_read(place: str) -> set[str]:
    """Fields of struct settings that the sources there read."""
    path = ROOT / place
    sources = [path] if path.is_file() else [*path.glob("*.[ch]")]
    assert sources, place
    names = {row.name for row in ROWS}
    return {name for source in sources for name in SETTING_READ.findall(source.read_text(encoding="utf-8"))} & names


def test_nothing_of_the_network_reads_a_setting() -> None:
    """The network has keys of its own (protocol/nvs.toml), and those are on trial."""
    assert {place: fields_read(place) for place in NETWORK} == {place: set() for place in NETWORK}


def test_the_binary_protocol_reads_only_how_long_a_host_may_be_silent() -> None:
    """A host with a TCP connection and no stream is never silent (docs/protocol.md), so it can set them back."""
    assert fields_read("core/session") == {"host_timeout_ms", "host_hold_on_gap", "status_interval_ms", "steps_per_mm"}
