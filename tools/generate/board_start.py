"""docs/start: from nothing to a moving machine, a page for each board with a chip, and the list of them."""

from __future__ import annotations

from collections.abc import Sequence

from wificnc.board.labels import notes, pin_rows
from wificnc.board.model import Board
from wificnc.flash.device import BOOT_HINT
from wificnc.flash.uhb import VENDOR

from generate.board_docs import GENERATED
from generate.install import download_text, install_lines
from generate.markdown import table_text
from generate.settings import environment

CONSOLE = "/dev/ttyUSB0"


def start_texts(boards: Sequence[Board]) -> dict[str, str]:
    """File name in docs/start -> text."""
    chips = [(board, board.pins.firmware.page) for board in boards if board.pins.firmware and board.pins.firmware.page]
    pages = {f"{board.id}.md": start_text(board, page) for board, page in chips}
    rows = [[f"[{board.id}]({board.id}.md)", board.name, board.summary] for board, _ in chips]
    rows.append(["[this computer](computer.md)", "no board", "The same controller as a program, to try everything on"])
    return {**pages, "README.md": index_text(table_text(["board", "name", ""], rows))}


def index_text(boards: str) -> str:
    """docs/start/README.md. @param boards  the table of the pages"""
    words = {"download": download_text(), "lines": install_lines(), "vendor": f"{VENDOR:04x}"}
    return environment().get_template("start.md.j2").render(generated=GENERATED, boards=boards, **words)


def start_text(board: Board, firmware: str) -> str:
    """One board's page. @param firmware  the page in docs/ about what runs on its chip"""
    is_esp32 = board.target == "esp32"
    pins = {row.label: row.pin for row in pin_rows(board)}
    warning = "\n".join(f"- {note}" for note in notes(board))
    return "\n".join(
        [
            _HEAD.format(generated=GENERATED, board=board, firmware=firmware),
            _WIRING.format(board=board, notes=warning or "None.", pins=_pins(board)),
            (_ESP32 if is_esp32 else _PIC32MZ).format(
                board=board, boot=BOOT_HINT, console=CONSOLE, tx=pins.get("console TX"), rx=pins.get("console RX")
            ),
            (_MACHINE_ESP32 if is_esp32 else _MACHINE).format(board=board, console=CONSOLE),
            *([_network(board)] if is_esp32 else []),
            _MOVES.format(console=CONSOLE),
        ]
    )


def _pins(board: Board) -> str:
    """What a machine is wired to, without what is soldered on the board."""
    rows = [row for row in pin_rows(board) if not row.label.startswith(("Ethernet", "console", "status LED"))]
    return table_text(["signal", "pin", "", "active"], [[r.label, f"`{r.pin}`", r.direction, r.active] for r in rows])


def _network(board: Board) -> str:
    return _NETWORK.format(ethernet=_ETHERNET if board.ethernet else "")


_HEAD = """{generated}

# {board.name}

`{board.id}`: {board.summary}.

**The firmware has not been run on this board yet**: what has been checked, and how, is in
[{firmware}](../{firmware}). Leave the motor supply switched off until the last section, and keep its switch
within reach.
"""

_WIRING = """## 1. Wire it

[Wiring](../wiring/README.md) shows what is connected to these pins: drivers, switches, spindle, laser, probe.

{notes}

![Pin-out of {board.name}](../../boards/pinout/{board.id}.svg)

{pins}

Active low: on when the pin is at ground. `$5`, `$6` and `$749` invert limits, probe and e-stop. The e-stop is pressed
while its contact is open, as is one that is not wired: bridge it on the desk
([E-stop](../wiring/switches.md#e-stop-door-buttons)). [boards.md](../boards.md#{board.id}) has every pin and the risks.
"""

_ESP32 = """## 2. Write the firmware

[Install `wificnc`](README.md#install-wificnc), then:

```
wificnc doctor                     # checks the tools and ports of this computer
wificnc flash {board.id}
```

The package of a release includes the firmware; from a checkout, `pip install -e '.[esp]'` and `wificnc build
{board.id}` come first. `wificnc flash` finds the board at its USB port, and refuses a chip or a memory type that
is not this board's. If it cannot connect: {boot}. The flasher page does the same in Chrome or Edge, with
nothing installed.

`wificnc monitor --to {console}` shows the output of the controller: `Grbl 1.1h ['$' for help]`, then the name
and the password of its own network. (Windows: `COM5`; macOS: `/dev/cu.usbserial-0001`.)
"""

_PIC32MZ = """## 2. Write the firmware

[Install `wificnc`](README.md#install-wificnc), then:

```
wificnc doctor                     # checks the tools and ports of this computer
wificnc flash {board.id} --dry-run    # the exact command
wificnc flash {board.id}
```

The package of a release includes the HEX file; from a checkout, `apt-get install gcc-mipsel-linux-gnu` and
`wificnc build {board.id}` come first. It is written through the board's USB bootloader, by `wificnc`
(`pip install hidapi`, `--tool uhb`) or by mikro_hb; or by a programmer, with pic32prog or MPLAB IPE.

The serial port is UART 3 (TX {tx}, RX {rx}) at 115200 baud. `wificnc monitor --to {console}` shows the output of the
controller: `Grbl 1.1h ['$' for help]`. (Windows: `COM5`; macOS: `/dev/cu.usbserial-0001`.)
"""

_NETWORK = """## 4. Connect it to the network

```
wificnc wifi set "My network"      # over USB; asks for the password
wificnc discover                   # wificnc-1a2b  tcp://192.168.1.20:23
wificnc wifi status                # over USB: the access key, which the network needs
wificnc login 192.168.1.20         # asks for it; for a day all programs of this computer may command
```

Who may command the machine over the network, and how to let a sender, a phone or LinuxCNC in:
[security.md](../security.md).

Without a cable: connect a phone to its own network, `WiFiCNC-XXXX`; the page that chooses the network opens by itself,
or is at `http://192.168.4.1/setup.html` ([first contact](../web.md#first-contact)).

Until it joins a network it opens its own one, with the address 192.168.4.1.{ethernet} It prints its
address on the serial ports whenever that changes. Senders connect to TCP port 23.
"""

_ETHERNET = " With a W5500 and a cable it uses Ethernet instead of WiFi."

_MACHINE_ESP32 = """## 3. Set up the machine

```
wificnc nvs build shapeoko3 --board {board.id}     # or your own machine profile: examples/machines
wificnc nvs flash nvs.bin
```

This replaces all stored data. `wificnc settings import shapeoko3` writes the same settings and leaves the rest. Or type
them: `$100` to `$105` steps/mm, `$110` maximum speeds, `$120` accelerations, `$130` travels
([settings.md](../settings.md)). A machine with fewer axes than the board: `$79`, which the profile sets; from the next
start on the others are gone.
"""

_MACHINE = """## 3. Set up the machine

```
wificnc settings import shapeoko3 --to {console}     # or your own machine profile: examples/machines
```

Or type the settings: `$100` to `$105` steps/mm, `$110` maximum speeds, `$120` accelerations, `$130` travels
([settings.md](../settings.md)). `wificnc settings export` saves them in a file. A machine with fewer axes than the
board: `$79`, which the profile sets; from the next start on the others are gone.
"""

_MOVES = """## The first moves

In short; [First move](../first-move.md) has each step with its tables, [First cut](../first-cut.md) what follows.
Switch on the motor supply.

```
export WIFICNC_TO={console}                # or 192.168.1.20:23; Windows: $env:WIFICNC_TO = "COM5"
wificnc monitor                               # type ? and press each switch: |Pn:X must show it
wificnc unlock                                # if it is locked
wificnc jog X1 --feed 100                     # wrong direction: $3
```

1. A switch is shown while it is open: `$5=1`. A switch is never shown: [troubleshooting](../troubleshooting.md).
2. An axis moves twice as far: correct its steps/mm. A motor whines and does not turn: reduce speed and acceleration.
3. Then the limits: `$21=1`; homing: `$22=1`, `$23` for axes that home towards their negative end, and `wificnc home`
   with the supply switch within reach. It homes Z, then X and Y. A switch on A, B or C needs a homing cycle:
   `$46=8`, `$47=16`, `$48=32`.
4. `wificnc send part.nc --dry-run`, then without it; other senders: [sender-setup.md](../sender-setup.md).
"""
