"""`wificnc wifi`: the network a board joins, over USB."""

from __future__ import annotations

from urllib.parse import quote

import rich_click as click

from wificnc import ui
from wificnc.commands._port import connected, port_option, progress_bars
from wificnc.commands._qr import show_qr
from wificnc.commands._secret import READ, Secret
from wificnc.commands._target import json_option
from wificnc.commands.flash import esp32_partitions
from wificnc.errors import FlashError
from wificnc.firmware.flash.plan import Region
from wificnc.firmware.nvs.build import build_image
from wificnc.firmware.nvs.image import NvsImage, read_image
from wificnc.firmware.nvs.values import NAMESPACE, merged, text_entry, without


@click.group()
def command() -> None:
    """The WiFi network that a board joins, and its own access point. Over USB; the board restarts afterwards."""


@command.command("set")
@click.argument("ssid")
@port_option
@click.option("--password", type=Secret(),
              help="Its password, empty for an open network. Prompted for if not given. " + READ)  # fmt: skip
def set_network(ssid: str, port: str | None, password: str | None) -> None:
    """Connect the board to the network SSID."""
    changes = [text_entry("wifi_ssid", ssid)]
    if password is None:
        password = click.prompt("password", hide_input=True, default="", show_default=False, err=True)
    if password:
        changes.append(text_entry("wifi_pass", password))
    partition = esp32_partitions()["nvs"]
    with connected(port) as device:
        image = read_image(device.read(partition.offset, partition.size))
        if image.damaged:
            device.reset()
            raise damaged_storage(image)
        kept = image if password else without(image, ["wifi_pass"])
        region = Region("settings", partition.offset, build_image(merged(kept, changes), partition.size))
        with progress_bars() as show:
            device.write([region], 115200, show)
        device.verify([region])
        device.reset()
    ui.note(f"the board joins {ssid} now; `wificnc discover` finds it there")


@command.command("status")
@port_option
@click.option("--qr/--no-qr", default=True, help="QR codes for a phone: the own network, and the page with the key.")
@json_option
def status(port: str | None, qr: bool, as_json: bool) -> None:
    """Show the network that the board joins, name and password of its own access point, and the access key."""
    partition = esp32_partitions()["nvs"]
    with connected(port) as device:
        mac = device.identify().mac
        image = read_image(device.read(partition.offset, partition.size))
        device.reset()
    facts = network_facts(image, mac)
    is_open = bool(facts["access_open"])
    if as_json:
        ui.emit_json(facts)
        return
    click.echo(f"joins         {facts['joins'] or 'no network'}")
    click.echo(f"own network   {facts['own_network']}")
    click.echo(f"its password  {facts['own_password'] or 'made at the first start'}")
    click.echo(
        f"access key    {facts['access_key'] or 'made at the first start'}{' (not needed: access is open)' * is_open}"
    )
    if qr and facts["own_password"]:
        show_qr("own network", wifi_code(str(facts["own_network"]), str(facts["own_password"])))
    if qr and facts["access_key"] and not is_open:
        show_qr("page, logged in", page_link(str(facts["name"]), str(facts["access_key"])))


def network_facts(image: NvsImage, mac: str) -> dict[str, str | bool | None]:
    """The password of the network it joins is not among them."""

    def text(key: str) -> str | None:
        value = image.get(NAMESPACE, key)
        return value if isinstance(value, str) else None

    return {
        "name": text("host_name") or own_name(mac),
        "joins": text("wifi_ssid"),
        "own_network": own_name(mac),
        "own_password": text("ap_pass"),
        "access_open": image.get(NAMESPACE, "access_open") == 1,
        "access_key": text("access_key"),
    }


def damaged_storage(image: NvsImage) -> FlashError:
    """A new image would leave out what cannot be read: perhaps the access key, or steps/mm."""
    return FlashError(
        f"the board's storage is damaged, nothing was written: {'; '.join(image.damaged)}",
        hint="`wificnc nvs read -o damaged.bin` saves a copy of it. To replace the whole storage on purpose: "
        "`wificnc nvs build MACHINE.toml --ssid SSID --wifi-password PASSWORD`, then `wificnc nvs flash nvs.bin`; "
        "access key and settings that the file does not have are new then",
    )


def own_name(mac: str) -> str:
    """WiFiCNC- and the end of the access point's address, which is the base address and one."""
    number = int(mac.replace(":", ""), 16) + 1
    return f"WiFiCNC-{number & 0xFFFF:04X}"


def wifi_code(name: str, password: str) -> str:
    """What phones read: special characters are escaped."""
    quoted = "".join(f"\\{letter}" if letter in '\\;,":' else letter for letter in password)
    return f"WIFI:T:WPA;S:{name};P:{quoted};;"


def page_link(name: str, key: str) -> str:
    """The page of a controller; what is behind # stays in the browser, which logs in with it."""
    return f"http://{name}.local/#key={quote(key, safe='')}"
