"""The pictures of docs/wiring: `make pictures`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import schemdraw.elements as elm

from wiring.sheet import DANGER, INK, SIGNAL, SUPPLY, Box, Point, Sheet

IMAGES = Path(__file__).parents[2] / "docs" / "wiring" / "images"


def machine() -> Sheet:
    """All of it, with the supplies."""
    sheet = Sheet()
    supply = sheet.box((0, 3.6), (2.6, 2.4), "motor supply", right=["24 to 48 V", "", "0 V"])
    drivers = sheet.box((6.6, 3.6), (2.6, 2.4), "drivers", left=["V+", "", "GND"], right=["coil A", "", "coil B"])
    board = sheet.box((0, 0), (2.6, 2.4), "controller board", left=["USB"], right=["step, direction", "e-stop", "GND"])
    motors = sheet.box((11, 3.6), (2.2, 2.4), "motors", left=["coil A", "", "coil B"])
    middle = supply["24 to 48 V"][1]
    sheet.part(elm.Button(nc=True).color(DANGER), (3.6, middle), (5.2, middle), "e-stop, contact 1")
    sheet.wire(supply["24 to 48 V"], (3.6, middle), colour=SUPPLY)
    sheet.wire((5.2, middle), drivers["V+"], colour=SUPPLY)
    sheet.wire(supply["0 V"], drivers["GND"])
    for coil in ("coil A", "coil B"):
        sheet.wire(drivers[coil], motors[coil])
    sheet.wire(board["step, direction"], (7.2, board["step, direction"][1]), (7.2, 3.6), colour=SIGNAL)
    row = board["e-stop"][1]
    sheet.part(elm.Button(nc=True).color(DANGER), (3.6, row), (5.2, row), "contact 2")
    sheet.wire(board["e-stop"], (3.6, row))
    sheet.wire((5.2, row), (5.8, row), (5.8, board["GND"][1]), ends="last")
    sheet.wire(board["GND"], (8.4, board["GND"][1]), (8.4, 3.6))
    sheet.text((8.6, 1.6), "signal ground, next to the signals", align="right")
    sheet.wire((-0.9, board["USB"][1]), board["USB"])
    sheet.text((-1.0, board["USB"][1]), "computer, 5 V", align="left")
    return sheet


SIGNALS = {"step": "PUL", "direction": "DIR", "enable": "ENA"}


def _driver(sheet: Sheet, corner: Point, common: str) -> Box:
    """A driver's input terminals, the common ones below."""
    own, other = ("+", "-") if common == "-" else ("-", "+")
    rows = [name + own for name in SIGNALS.values()] + [name + other for name in SIGNALS.values()]
    return sheet.box(corner, (2.2, 5.0), "driver", left=rows)


def _join(sheet: Sheet, driver: Box, sign: str, begin: Point, colour: str) -> None:
    """The common terminals, and a wire from them."""
    places = [driver[name + sign] for name in SIGNALS.values()]
    bus = places[0][0] - 0.8
    for place in places:
        sheet.wire((bus, place[1]), place, colour=colour, ends="first")
    sheet.wire((bus, places[0][1]), (bus, places[-1][1]), colour=colour)
    sheet.wire(begin, (bus, begin[1]), colour=colour, ends="last")


def driver_cathode() -> Sheet:
    sheet = Sheet()
    board = sheet.box((0, 0), (2.4, 5.0), "controller board", right=[*SIGNALS, "", "GND", ""])
    driver = _driver(sheet, (6.4, 0), "-")
    for pin, name in SIGNALS.items():
        sheet.wire(board[pin], driver[name + "+"], colour=SIGNAL)
    _join(sheet, driver, "-", board["GND"], INK)
    return sheet


def driver_anode() -> Sheet:
    sheet = Sheet()
    board = sheet.box((0, 0), (2.4, 5.0), "controller board", right=[*SIGNALS, "", "3.3 V", ""])
    driver = _driver(sheet, (6.4, 0), "+")
    for pin, name in SIGNALS.items():
        sheet.wire(board[pin], driver[name + "-"], colour=SIGNAL)
    _join(sheet, driver, "+", board["3.3 V"], SUPPLY)
    return sheet


def driver_buffer() -> Sheet:
    """3.3 V to 5 V."""
    sheet = Sheet()
    board = sheet.box((0, 0), (2.4, 5.0), "controller board", right=[*SIGNALS, "5 V", "GND", ""])
    chip = sheet.box((4.6, 0), (2.2, 5.0), "74HCT245", left=["A1", "A2", "A3", "VCC DIR", "GND OE", ""],
                     right=["B1", "B2", "B3", "", "", ""])  # fmt: skip
    driver = _driver(sheet, (10.4, 0), "-")
    for pin, name, way in zip(SIGNALS, SIGNALS.values(), "123", strict=True):
        sheet.wire(board[pin], chip["A" + way], colour=SIGNAL)
        sheet.wire(chip["B" + way], driver[name + "+"], colour=SIGNAL)
    sheet.wire(board["5 V"], chip["VCC DIR"], colour=SUPPLY)
    sheet.wire(board["GND"], chip["GND OE"])
    bus = driver["PUL-"][0] - 0.8
    low = -0.8
    sheet.wire((3.4, board["GND"][1]), (3.4, low), (bus, low), ends="first")
    _join(sheet, driver, "-", (bus, low), INK)
    sheet.wire((bus, low), (bus, driver["ENA-"][1]))
    return sheet


def switch_closed() -> Sheet:
    """Normally closed, to ground."""
    sheet = Sheet()
    board = sheet.box((9, 0), (2.6, 4.4), "controller board", left=["3.3 V", "", "limit", "", "GND"])
    row, high, low = board["limit"][1], board["3.3 V"][1], board["GND"][1]
    sheet.wire(board["limit"], (3.6, row), colour=SIGNAL)
    sheet.wire(board["3.3 V"], (5.4, high), colour=SUPPLY)
    sheet.part(elm.Resistor(), (5.4, high), (5.4, row), "4.7 kOhm", "bottom")
    sheet.part(elm.Capacitor(), (7.2, row), (7.2, low), "100 nF", "bottom")
    sheet.wire(board["GND"], (0.6, low), (0.6, row))
    sheet.part(elm.Button(nc=True), (0.6, row), (2.0, row), "limit switch, NC")
    sheet.wire((2.0, row), (3.6, row), colour=SIGNAL)
    sheet.dot((5.4, row), (7.2, row), (7.2, low))
    sheet.wire((2.4, row + 0.25), (4.6, row + 0.25), dashed=True)
    sheet.wire((2.4, low - 0.25), (4.6, low - 0.25), dashed=True)
    sheet.text((3.5, low - 0.65), "twisted pair, or a shield that is")
    sheet.text((3.5, low - 1.05), "grounded at the board only")
    return sheet


def _opto(sheet: Sheet, words: tuple[str, str]) -> tuple[Point, Point]:
    """An optocoupler before an input. @return its two ends at the side of the machine"""
    board = sheet.box((11, 0), (2.6, 4.2), "controller board", left=["3.3 V", "", "input", "", "GND"])
    opto = sheet.box((4.6, 0), (3.2, 4.2), "optocoupler", left=["anode", "", "cathode"],
                     right=["", "", "collector", "", "emitter"])  # fmt: skip
    row, high = board["input"][1], board["3.3 V"][1]
    sheet.wire(opto["collector"], board["input"], colour=SIGNAL)
    sheet.wire(opto["emitter"], board["GND"])
    sheet.wire(board["3.3 V"], (9.9, high), colour=SUPPLY)
    sheet.part(elm.Resistor(), (9.9, high), (9.9, row))
    sheet.text((9.6, (high + row) / 2), "4.7 kOhm", align="left")
    sheet.dot((9.9, row))
    for line, text in enumerate(words):
        sheet.text((6.2, -0.3 - 0.4 * line), text, size=9)
    return opto["anode"], opto["cathode"]


def switch_opto() -> Sheet:
    """A switch at 24 V."""
    sheet = Sheet()
    anode, cathode = _opto(sheet, ("LED: 24 V less 1.2 V,", "by 2.2 kOhm: 10 mA"))
    sheet.part(elm.Resistor(), (2.6, anode[1]), anode, "2.2 kOhm")
    sheet.part(elm.Button(nc=True), (0.8, anode[1]), (2.6, anode[1]), "switch, NC")
    sheet.wire((-0.6, anode[1]), (0.8, anode[1]), colour=SUPPLY)
    sheet.text((-0.7, anode[1]), "+24 V", align="left", colour=SUPPLY)
    sheet.wire((-0.6, cathode[1]), cathode)
    sheet.text((-0.7, cathode[1]), "0 V", align="left")
    return sheet


def sensor_npn() -> Sheet:
    """An inductive sensor, NPN."""
    sheet = Sheet()
    anode, cathode = _opto(sheet, ("the sensor switches", "the cathode to 0 V"))
    sensor = sheet.box((-2.4, 0.85), (2.2, 2.5), "sensor, NPN", right=["brown", "black", "blue"])
    sheet.part(elm.Resistor(), (2.4, anode[1]), anode, "2.2 kOhm")
    sheet.wire(sensor["brown"], (2.4, anode[1]), colour=SUPPLY)
    sheet.wire((1.0, anode[1]), (1.0, 4.0), colour=SUPPLY, ends="first")
    sheet.text((1.0, 4.25), "+24 V", colour=SUPPLY)
    sheet.wire(sensor["black"], (3.2, sensor["black"][1]), (3.2, cathode[1]), cathode, colour=SIGNAL)
    sheet.wire(sensor["blue"], (1.0, sensor["blue"][1]), (1.0, -0.2))
    sheet.text((1.0, -0.4), "0 V")
    return sheet


def relay() -> Sheet:
    """A router or a pump at a relay."""
    sheet = Sheet()
    board = sheet.box((0, 0), (2.6, 3.2), "controller board", right=["5 V", "spindle on", "GND"])
    module = sheet.box((5, 0), (2.6, 3.2), "relay module", left=["VCC", "IN", "GND"], right=["NO", "COM", "NC"])
    for pin, name, colour in (("5 V", "VCC", SUPPLY), ("spindle on", "IN", SIGNAL), ("GND", "GND", INK)):
        sheet.wire(board[pin], module[name], colour=colour)
    load = sheet.box((11, 0), (2.4, 3.2), "router, pump", left=["L", "", "N"])
    sheet.wire(module["NO"], load["L"], colour=DANGER)
    sheet.wire(module["COM"], (9.0, module["COM"][1]), (9.0, -0.9), colour=DANGER)
    sheet.part(elm.Fuse().color(DANGER), (9.0, -0.9), (9.0, -2.3), "fuse", "bottom")
    sheet.wire((9.0, -2.3), (9.0, -2.7), colour=DANGER)
    sheet.text((9.0, -2.95), "mains L", colour=DANGER)
    sheet.wire(load["N"], (10.4, load["N"][1]), (10.4, -2.7), colour=DANGER)
    sheet.text((10.4, -2.95), "mains N", colour=DANGER)
    return sheet


def tmc() -> Sheet:
    """Drivers with registers: one wire for all by UART, a chain by SPI."""
    sheet = Sheet()
    board = sheet.box((0, 4.2), (2.6, 2.4), "board, UART", right=["TX", "RX", "GND"])
    first = sheet.box((7, 4.2), (2.6, 2.4), "TMC2209, address 0", left=["PDN_UART", "", "GND"])
    second = sheet.box((11.4, 4.2), (2.6, 2.4), "TMC2209, address 1", left=["PDN_UART", "", "GND"])
    bus, line = 5.6, board["RX"][1]
    sheet.part(elm.Resistor(), (3.2, board["TX"][1]), (4.9, board["TX"][1]), "1 kOhm")
    sheet.wire(board["TX"], (3.2, board["TX"][1]), colour=SIGNAL)
    sheet.wire((4.9, board["TX"][1]), (bus, board["TX"][1]), (bus, line), colour=SIGNAL, ends="last")
    sheet.wire(board["RX"], (bus, line), colour=SIGNAL)
    for driver in (first, second):
        at, pin = driver["PDN_UART"]
        sheet.wire((bus, line), (bus, 3.7), (at - 0.7, 3.7), (at - 0.7, pin), (at, pin), colour=SIGNAL)
    chain = sheet.box((0, 0), (2.6, 2.6), "board, SPI", right=["MOSI", "SCK, CS", "MISO"])
    places = [
        sheet.box((x, 0), (2.6, 2.6), f"TMC5160, place {n}", left=["SDI", "SCK, CSN", ""], right=["SDO", "", ""])
        for n, x in enumerate((5.2, 10.2))
    ]
    sheet.wire(chain["MOSI"], places[0]["SDI"], colour=SIGNAL)
    sheet.wire(places[0]["SDO"], places[1]["SDI"], colour=SIGNAL)
    sheet.wire(chain["SCK, CS"], places[0]["SCK, CSN"], colour=SIGNAL)
    end, row = places[1]["SDO"], -0.5
    sheet.wire(end, (end[0] + 0.6, end[1]), (end[0] + 0.6, row), (3.4, row), (3.4, chain["MISO"][1]), chain["MISO"],
               colour=SIGNAL)  # fmt: skip
    return sheet


def vfd() -> Sheet:
    """Speed by 0 to 10 V, on and direction by relays."""
    sheet = Sheet()
    board = sheet.box((0, -0.4), (2.8, 4.6), "controller board",
                      right=["spindle PWM", "GND", "", "spindle on", "direction"])  # fmt: skip
    rows = {name: board[name][1] for name in ("spindle PWM", "GND", "spindle on", "direction")}
    converter = sheet.box((4.8, 2.1), (3.0, 2.1), "PWM to 0-10 V", left=["PWM", "GND"], right=["0-10 V", "0 V"])
    drive = sheet.box((12.2, -0.4), (2.8, 4.6), "VFD", left=["AI (VI)", "ACM", "RUN (FWD)", "F/R (REV)", "DCM"],
                      right=["U", "V", "W"])  # fmt: skip
    relays = sheet.box((4.8, -0.4), (3.0, 1.7), "two relays", left=["IN 1", "IN 2"], right=["NO 1", "NO 2"])
    sheet.wire(board["spindle PWM"], (3.8, rows["spindle PWM"]), (3.8, converter["PWM"][1]), converter["PWM"],
               colour=SIGNAL)  # fmt: skip
    sheet.wire(board["GND"], (3.4, rows["GND"]), (3.4, converter["GND"][1]), converter["GND"])
    sheet.wire(board["spindle on"], (3.8, rows["spindle on"]), (3.8, relays["IN 1"][1]), relays["IN 1"], colour=SIGNAL)
    sheet.wire(board["direction"], (3.4, rows["direction"]), (3.4, relays["IN 2"][1]), relays["IN 2"], colour=SIGNAL)
    sheet.wire(converter["0-10 V"], (10.6, converter["0-10 V"][1]), (10.6, drive["AI (VI)"][1]), drive["AI (VI)"],
               colour=SIGNAL)  # fmt: skip
    sheet.wire(converter["0 V"], (10.2, converter["0 V"][1]), (10.2, drive["ACM"][1]), drive["ACM"])
    sheet.wire(
        relays["NO 1"], (9.6, relays["NO 1"][1]), (9.6, drive["RUN (FWD)"][1]), drive["RUN (FWD)"], colour=SIGNAL
    )
    sheet.wire(
        relays["NO 2"], (10.2, relays["NO 2"][1]), (10.2, drive["F/R (REV)"][1]), drive["F/R (REV)"], colour=SIGNAL
    )
    sheet.wire(drive["DCM"], (11.2, drive["DCM"][1]), (11.2, -1.2), (6.3, -1.2))
    sheet.text((6.2, -1.2), "COM of both relays", align="left")
    for phase in ("U", "V", "W"):
        sheet.wire(drive[phase], (15.8, drive[phase][1]), colour=DANGER)
    sheet.text((15.95, drive["V"][1]), "spindle, shielded cable", align="right", colour=DANGER)
    return sheet


def laser() -> Sheet:
    """TTL input, pull-down resistor, a supply that the interlock and the e-stop switch off."""
    sheet = Sheet()
    board = sheet.box((0, 0), (2.8, 2.8), "controller board", right=["spindle PWM", "", "GND"])
    module = sheet.box((9, 0), (2.8, 4.2), "laser module", left=["+12 V, +24 V", "", "TTL, PWM", "", "0 V"])
    pwm, ground = module["TTL, PWM"][1], module["0 V"][1]
    sheet.wire(board["spindle PWM"], (4.2, board["spindle PWM"][1]), (4.2, pwm), module["TTL, PWM"], colour=SIGNAL)
    sheet.wire(board["GND"], (3.8, board["GND"][1]), (3.8, ground), module["0 V"])
    sheet.part(elm.Resistor(), (6.4, pwm), (6.4, ground))
    sheet.text((6.7, (pwm + ground) / 2), "4.7 kOhm", align="right")
    sheet.dot((6.4, pwm), (6.4, ground))
    high = module["+12 V, +24 V"][1]
    sheet.part(elm.Button(nc=True).color(DANGER), (3.0, high + 1.2), (4.6, high + 1.2), "e-stop")
    sheet.part(elm.Button(nc=True).color(DANGER), (5.6, high + 1.2), (7.2, high + 1.2), "lid switch")
    sheet.wire((1.4, high + 1.2), (3.0, high + 1.2), colour=SUPPLY)
    sheet.wire((4.6, high + 1.2), (5.6, high + 1.2), colour=SUPPLY)
    sheet.wire((7.2, high + 1.2), (8.0, high + 1.2), (8.0, high), module["+12 V, +24 V"], colour=SUPPLY)
    sheet.text((1.3, high + 1.2), "laser supply +", align="left", colour=SUPPLY)
    sheet.wire((5.2, ground), (5.2, -0.9), ends="first")
    sheet.text((5.2, -1.15), "laser supply 0 V")
    return sheet


def gantry() -> Sheet:
    """Two motors on Y, a switch at each side."""
    sheet = Sheet()
    names = ["Y step", "Y direction", "Y2 step", "Y2 direction", "Y limit", "Y2 limit"]
    board = sheet.box((0, 0), (2.8, 5.2), "controller board", right=names)
    left = sheet.box((6.4, 3.4), (2.4, 1.9), "driver Y", left=["step", "direction"], right=["motor"])
    right = sheet.box((6.4, 0.4), (2.4, 1.9), "driver Y2", left=["step", "direction"], right=["motor"])
    for prefix, box, x in (("Y", left, 3.9), ("Y2", right, 4.7)):
        for name, shift in (("step", 0.0), ("direction", 0.35)):
            begin, end = board[f"{prefix} {name}"], box[name]
            sheet.wire(begin, (x + shift, begin[1]), (x + shift, end[1]), end, colour=SIGNAL)
    sheet.block((11, -0.8), (0.5, 6.6), "#dfe4ea")
    sheet.block((15.4, -0.8), (0.5, 6.6), "#dfe4ea")
    sheet.block((10.6, 2.4), (5.7, 0.7), "#e8eef7")
    sheet.text((13.4, 2.75), "gantry")
    sheet.wire(left["motor"], (10.2, left["motor"][1]), (10.2, 5.2), (11, 5.2))
    sheet.wire(right["motor"], (9.8, right["motor"][1]), (9.8, -1.3), (15.65, -1.3), (15.65, -0.8))
    sheet.text((11.7, 5.2), "motor Y", align="right")
    sheet.text((15.2, -0.4), "motor Y2", align="left")
    for x, align, y, name in ((11.8, "right", 1.3, "switch of Y"), (15.1, "left", 0.5, "switch of Y2")):
        sheet.add(elm.Dot(radius=0.12).at((x, y)).color(DANGER))
        sheet.text((x + (0.25 if align == "right" else -0.25), y), name, align=align, colour=DANGER)
    return sheet


def probe() -> Sheet:
    """A plate, and a clip at the tool."""
    sheet = Sheet()
    board = sheet.box((0, 0), (2.6, 3.8), "controller board", right=["3.3 V", "", "probe", "", "GND"])
    row, high, low = board["probe"][1], board["3.3 V"][1], board["GND"][1]
    sheet.wire(board["3.3 V"], (3.6, high), colour=SUPPLY)
    sheet.part(elm.Resistor(), (3.6, high), (3.6, row), "2.2 kOhm", "bottom")
    sheet.part(elm.Resistor(), (4.6, row), (6.4, row), "100 Ohm")
    sheet.wire(board["probe"], (4.6, row), colour=SIGNAL)
    sheet.part(elm.Capacitor(), (4.4, row), (4.4, low))
    sheet.text((4.9, (row + low) / 2 - 0.1), "10 nF", align="right")
    sheet.dot((3.6, row), (4.4, row), (4.4, low))
    sheet.wire((6.4, row), (8.2, row), (8.2, 0.2), (9.0, 0.2), colour=SIGNAL)
    sheet.block((9.0, 0), (3.0, 0.45), "#dfe4ea")
    sheet.text((10.5, 0.22), "plate")
    sheet.block((8.6, -0.55), (3.8, 0.5), "#f3e3cf")
    sheet.text((10.5, -0.3), "work")
    sheet.block((10.25, 1.0), (0.5, 1.5), "#e8eef7")
    sheet.text((11.0, 1.7), "tool, with the clip", align="right")
    sheet.wire(board["GND"], (7.4, low), (7.4, 3.0), (10.5, 3.0), (10.5, 2.5))
    return sheet


def pendant() -> Sheet:
    """A UART, crossed, and the pendant's supply."""
    sheet = Sheet()
    names = ["5 V", "TX", "RX", "GND"]
    board = sheet.box((0, 0), (2.6, 3.4), "controller board", right=names)
    hand = sheet.box((8.6, 0), (2.6, 3.4), "pendant", left=names)
    sheet.wire(board["5 V"], hand["5 V"], colour=SUPPLY)
    sheet.wire(board["GND"], hand["GND"])
    for begin, end in (("TX", "RX"), ("RX", "TX")):
        middle = 5.6
        start, stop = board[begin], hand[end]
        sheet.wire(start, (middle - 0.7, start[1]), (middle + 0.7, stop[1]), stop, colour=SIGNAL)
    sheet.text((5.6, -0.4), "shielded cable, up to 2 m; 3.3 V signals")
    return sheet


def dial() -> Sheet:
    """Two lines of pulses, and the selectors of a pendant box."""
    sheet = Sheet()
    lines = ["dial A", "dial B", "axis X", "axis Y", "x10", "GND", "5 V"]
    board = sheet.box((0, 0), (2.8, 6.0), "controller board", right=lines)
    wheel = sheet.box((9.4, 2.9), (2.6, 3.1), "hand wheel", left=["A", "B", "0 V", "5 V"])
    knobs = sheet.box((9.4, -1.6), (2.6, 3.3), "selectors", left=["X", "Y", "x10", "COM"])
    for name in ("A", "B"):
        row, end = board[f"dial {name}"][1], wheel[name]
        sheet.wire(board[f"dial {name}"], (7.2, row), (7.6, end[1]), end, colour=SIGNAL)
    for name, bend in (("axis X", 6.6), ("axis Y", 6.1), ("x10", 5.6)):
        end = knobs[name.removeprefix("axis ")]
        sheet.wire(board[name], (bend, board[name][1]), (bend, end[1]), end, colour=SIGNAL)
    ground = board["GND"][1]
    sheet.wire(board["GND"], (8.4, ground), (8.4, wheel["0 V"][1]), wheel["0 V"])
    sheet.wire((8.4, ground), (8.4, knobs["COM"][1]), knobs["COM"], ends="first")
    sheet.wire(board["5 V"], (8.0, board["5 V"][1]), (8.0, wheel["5 V"][1]), wheel["5 V"], colour=SUPPLY)
    sheet.text((4.6, -1.0), "shielded cable; A and B at 3.3 V")
    return sheet


PICTURES: dict[str, Callable[[], Sheet]] = {
    "machine": machine,
    "driver-cathode": driver_cathode,
    "driver-anode": driver_anode,
    "driver-buffer": driver_buffer,
    "switch-closed": switch_closed,
    "switch-opto": switch_opto,
    "sensor-npn": sensor_npn,
    "relay": relay,
    "tmc": tmc,
    "vfd": vfd,
    "laser": laser,
    "gantry": gantry,
    "probe": probe,
    "pendant": pendant,
    "dial": dial,
}


def main() -> None:
    IMAGES.mkdir(parents=True, exist_ok=True)
    for name, draw in PICTURES.items():
        (IMAGES / f"{name}.svg").write_text(draw().svg(), encoding="utf-8")


if __name__ == "__main__":
    main()
