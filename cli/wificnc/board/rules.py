"""Pass 2, the rules: each is a pure function from a board and its chip to what breaks it."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from math import ceil
from typing import Any

from wificnc.board.chip import Chip
from wificnc.board.driver_rules import drivers
from wificnc.board.model import AXES_MAX, AXIS_LETTERS, BoardFile, Led, Role, Timing, Use
from wificnc.board.shift_registers import on_grid_ns, pulse_engine, shift_registers
from wificnc.board.wire import OutputWire, Wire
from wificnc.files.problem import Finding, KeyPath, key_text
from wificnc.files.shape import closest, step_type

NS_PER_S = 1_000_000_000
SPARE_EVENTS_HZ = 500  # a segment takes 2 ms or more
HINT_PINS_MAX = 10
NO_CHIP_PINS = ("3V3", "5V", "VIN", "GND", "EN", "RST")

# Rules that an `allow` with a reason may suppress: a risk the wiring can take away, never an impossibility.
ALLOWABLE = ("strapping", "boot-level", "boot-glitch", "usb", "console", "debug")

UseRule = Callable[[BoardFile, Chip, Use], Iterator[Finding]]
BoardRule = Callable[[BoardFile, Chip], Iterator[Finding]]


def check_rules(board: BoardFile, chip: Chip, faults: Sequence[KeyPath] = ()) -> list[Finding]:
    """Everything that is wrong with the board, earned opt-outs applied.

    @param faults  places of the file with a stand-in: rules that read these tables say nothing
    """
    tables = {str(place[0]) for place in faults if place}
    found: list[Finding] = []
    for use in board.uses():
        found += _check_use(board, chip, use)
    found = [finding for finding in found if not tables & set(_PIN_TABLES.get(finding.rule, ()))]
    for rule, read in BOARD_RULES.items():
        if not tables & set(read):
            found += rule(board, chip)
    return found


def _check_use(board: BoardFile, chip: Chip, use: Use) -> Iterator[Finding]:
    if use.pin not in chip.pin:
        yield _no_such_pin(board, chip, use)
        return
    broken = pin_findings(board, chip, use)
    allow = use.wire.allow
    hint = _free_pins_hint(board, chip, use) if any(found.rule not in allow for found in broken) else None
    for found in broken:
        if found.rule not in ALLOWABLE or found.rule not in allow:
            yield Finding(found.rule, found.path, found.reason, found.hint or hint)
    yield from _check_allow(use, {found.rule for found in broken})


def pin_findings(board: BoardFile, chip: Chip, use: Use) -> list[Finding]:
    """What speaks against this pin in this use, opt-outs aside."""
    return [found for rule in USE_RULES for found in rule(board, chip, use)]


def _check_allow(use: Use, broken: set[str]) -> Iterator[Finding]:
    for rule in use.wire.allow:
        path = (*use.path, "allow", rule)
        if rule not in ALLOWABLE:
            meant = closest(rule, ALLOWABLE)
            yield Finding(
                "unknown-allow",
                path,
                "is not a rule that can be allowed",
                f"did you mean {meant}?" if meant else f"these can: {', '.join(ALLOWABLE)}",
            )
        elif rule not in broken:
            reason = f"suppresses nothing: {use.pin} does not break this rule here"
            yield Finding("stale-allow", path, reason, "remove it")


def _no_such_pin(board: BoardFile, chip: Chip, use: Use) -> Finding:
    meant = closest(use.pin, chip.pin)
    guess = f"did you mean {meant}? " if meant else ""
    return Finding(
        "no-such-pin",
        use.path,
        f"{chip.name} has no pin {use.pin!r}",
        f"{guess}{_free_pins_hint(board, chip, use)}",
    )


# ---- one pin in one use --------------------------------------------------------------------------------------------


def _capability(board: BoardFile, chip: Chip, use: Use) -> Iterator[Finding]:
    pin = chip.pin[use.pin]
    if use.is_output and not pin.output:
        yield Finding("input-only", use.path, f"{use.pin} can only be read on {chip.name} and this is an output")
    if not use.is_output and not pin.input:
        yield Finding("output-only", use.path, f"{use.pin} cannot be read on {chip.name} and this is an input")


def _pull(board: BoardFile, chip: Chip, use: Use) -> Iterator[Finding]:
    if not chip.pin[use.pin].can_pull(use.pull):
        reason = f'{use.pin} has no internal pull-{use.pull} resistor; fit one in the wiring and write pull = "none"'
        yield Finding("no-pull", use.path, reason)


def _taken(board: BoardFile, chip: Chip, use: Use) -> Iterator[Finding]:
    owner = chip.pin[use.pin].taken_in(board.memory.mode)
    if owner:
        yield Finding("taken", use.path, f'{use.pin} belongs to {owner} (memory.mode = "{board.memory.mode}")')


def _brought_out(board: BoardFile, chip: Chip, use: Use) -> Iterator[Finding]:
    if not is_reachable(board, use.pin):
        reason = f"{use.pin} is not on a header of this board and cannot be wired"
        yield Finding("not-brought-out", use.path, reason)


def _strapping(board: BoardFile, chip: Chip, use: Use) -> Iterator[Finding]:
    strap = chip.pin[use.pin].strap
    if strap:
        must = "is read" if strap.at_boot == "any" else f"must read {strap.at_boot}"
        reason = f"{use.pin} {must} while the chip starts: {strap.otherwise} ({strap.ref})"
        yield Finding("strapping", use.path, reason)


def _boot_level(board: BoardFile, chip: Chip, use: Use) -> Iterator[Finding]:
    pin = chip.pin[use.pin]
    effect = f"{use.active} switches {use.signal} on"
    if use.can_hurt and pin.level_at_reset() == use.active:
        reason = f"{use.pin} has a {pin.reset} from reset until the firmware runs, and {effect}"
        yield Finding("boot-level", use.path, reason)
    if use.can_hurt and pin.reset == "undefined":
        reason = f"{use.pin} has an undefined level from power-up until the firmware runs, and {effect}"
        yield Finding("boot-level", use.path, reason)
    if use.can_hurt and use.active in pin.glitch:
        reason = f"{use.pin} goes {use.active} for about 60 us at power-up, and {effect}"
        yield Finding("boot-glitch", use.path, reason)


def _shared_function(board: BoardFile, chip: Chip, use: Use) -> Iterator[Finding]:
    pin = chip.pin[use.pin]
    if pin.usb:
        yield Finding("usb", use.path, f"{use.pin} is {pin.usb}: the USB port does not work when the pin is used")
    if pin.console:
        reason = f"{use.pin} is {pin.console}: the boot messages, the console and the flasher use it"
        yield Finding("console", use.path, reason)
    if pin.debug:
        reason = f"{use.pin} is {pin.debug}: a debugger cannot be used with this wiring"
        yield Finding("debug", use.path, reason)


def _fast_path(board: BoardFile, chip: Chip, use: Use) -> Iterator[Finding]:
    if use.role in (Role.STEP, Role.DIR) and not chip.is_fast(use.pin):
        banks = ", ".join(chip.fast.banks)
        yield Finding("fast-path", use.path, f"{use.pin} is not in the registers the step interrupt writes ({banks})")


USE_RULES: tuple[UseRule, ...] = (
    _capability,
    _pull,
    _taken,
    _brought_out,
    _strapping,
    _boot_level,
    _shared_function,
    _fast_path,
)


# ---- the board as a whole ------------------------------------------------------------------------------------------


def _used_once(board: BoardFile, chip: Chip) -> Iterator[Finding]:
    users: dict[str, list[Use]] = defaultdict(list)
    for use in board.uses():
        users[use.pin].append(use)
    for pin, uses in users.items():
        for use in uses[1:]:
            reason = f"{pin} is already wired to {key_text(uses[0].path)}"
            yield Finding("used-twice", use.path, reason, _free_pins_hint(board, chip, use))


def _axes_contiguous(board: BoardFile, chip: Chip) -> Iterator[Finding]:
    wired = board.axis.wired()
    order = AXIS_LETTERS.lower()
    for letter in wired:
        gaps = [before for before in order[: order.index(letter)] if before not in wired]
        if gaps:
            reason = f"axis {letter.upper()} is wired but {gaps[0].upper()} is not; axes count from X on without a gap"
            yield Finding("axis-order", ("axis", letter), reason)


def _one_kind_of_limit(board: BoardFile, chip: Chip) -> Iterator[Finding]:
    for name, motor in board.axis.motors().items():
        if motor.limit and (motor.limit_min or motor.limit_max):
            yield Finding(
                "limit-kind",
                ("axis", *((name[0], "second") if name.endswith("2") else (name,)), "limit"),
                "cannot be used together with limit_min or limit_max",
                "one switch or one line for both ends: limit; a line for each end: limit_min and limit_max",
            )


def _second_switch(board: BoardFile, chip: Chip) -> Iterator[Finding]:
    """Homing looks at the first motor's kind of switch; without one at the second motor it stops both at that one."""
    for letter, axis in board.axis.wired().items():
        if axis.second is None:
            continue
        for kind, at_home in (("home switch", True), ("limit", False)):
            if axis.second.has_switch(at_home=at_home) and not axis.has_switch(at_home=at_home):
                reason = f"has a {kind}, but the first motor has none, so homing would not look at it"
                hint = f"wire the {kind} of the first motor; a gantry with one switch has it there"
                yield Finding("second-switch", ("axis", letter, "second"), reason, hint)
        if axis.limit_ends and axis.second.limit_ends and not axis.limit_ends & axis.second.limit_ends:
            reason = "has its limit at the other end than the first motor, so homing would not find both"
            hint = "a gantry is squared at one end: wire the limits of both motors there"
            yield Finding("second-switch", ("axis", letter, "second"), reason, hint)


def _second_motor(board: BoardFile, chip: Chip) -> Iterator[Finding]:
    seconds = [letter for letter, axis in board.axis.wired().items() if axis.second]
    count = len(board.axis.motors())
    if seconds and count > AXES_MAX and board.target != "host":
        reason = f"the firmware of the {chip.name} drives {AXES_MAX} motors, and with this one there are {count}"
        hint = "leave out the last axis, or wire both drivers to one pair of step and direction pins"
        yield Finding("second-motor", ("axis", seconds[-1], "second"), reason, hint)


def _servo(board: BoardFile, chip: Chip) -> Iterator[Finding]:
    if board.output.servo and board.target == "pic32mz":
        reason = "the firmware of the PIC32MZ has no output for an RC servo"
        yield Finding("servo", ("output", "servo"), reason, "leave it out")


def _spindle_bus(board: BoardFile, chip: Chip) -> Iterator[Finding]:
    bus = board.spindle_bus
    if bus is None:
        return
    for key, pins in chip.spindle_pins.items():
        if getattr(bus, key).pin not in pins:
            reason = f"the firmware of the {chip.name} has this line of the bus at {', '.join(pins)} only"
            yield Finding("spindle-bus", ("spindle_bus", key), reason, f'{key} = "{pins[0]}"')
    if bus.uart in chip.spindle_uarts:
        return
    if chip.spindle_uarts:
        reason = f"{chip.name} has no UART {bus.uart!r} to spare"
        yield Finding("spindle-bus", ("spindle_bus", "uart"), reason, f"one of: {', '.join(chip.spindle_uarts)}")
    else:
        reason = f"the firmware of the {chip.name} has no RS-485 bus for a spindle drive"
        yield Finding("spindle-bus", ("spindle_bus",), reason, "leave it out, and use PWM or a relay")


def _pendant(board: BoardFile, chip: Chip) -> Iterator[Finding]:
    pendant = board.pendant
    if pendant is None:
        return
    if not chip.pendant_uarts:
        reason = f"the firmware of the {chip.name} has one connection for text, and a pendant needs another one"
        yield Finding("pendant", ("pendant",), reason, "leave it out, and connect the pendant as the sender")
    elif pendant.uart not in chip.pendant_uarts:
        reason = f"{chip.name} has no UART {pendant.uart!r} to spare"
        yield Finding("pendant", ("pendant", "uart"), reason, f"one of: {', '.join(chip.pendant_uarts)}")
    elif board.spindle_bus and board.spindle_bus.uart == pendant.uart:
        reason = f"{pendant.uart} is the spindle drive's already"
        free = [uart for uart in chip.pendant_uarts if uart != pendant.uart]
        yield Finding("pendant", ("pendant", "uart"), reason, f"one of: {', '.join(free)}")


def _dial(board: BoardFile, chip: Chip) -> Iterator[Finding]:
    dial = board.dial
    if dial is None:
        return
    for name in dial.axis.named():
        if name not in board.axis.wired():
            reason = f"the board has no axis {name.upper()}"
            yield Finding("dial", ("dial", "axis", name), reason, "leave it out, or wire the axis")
    if dial.x100 and not dial.x10:
        reason = "a step switch has x10 as well"
        yield Finding("dial", ("dial", "x100"), reason, "wire x10, or set $401 instead of a switch")
    if dial.a.active != dial.b.active:
        reason = "has another active level than line a, and both lines are of one wheel"
        yield Finding("dial", ("dial", "b"), reason, f'active = "{dial.a.active}"')


def _charge_pump(board: BoardFile, chip: Chip) -> Iterator[Finding]:
    hz = board.output.charge_pump_hz
    if board.output.charge_pump is None:
        if hz != type(board.output).model_fields["charge_pump_hz"].default:
            reason = "is the frequency of a charge pump, and this board has none"
            yield Finding("charge-pump", ("output", "charge_pump_hz"), reason, "wire charge_pump, or leave it out")
    elif chip.pump is None or not chip.pump.makes(hz):
        timer = chip.pump
        reason = f"the timer of the {chip.name} does not make {hz} Hz"
        slowest = -(-timer.clock_hz // timer.ticks_max) if timer else 0
        hint = f"{slowest} to {timer.clock_hz // timer.ticks_min} Hz" if timer else "leave charge_pump out"
        yield Finding("charge-pump", ("output", "charge_pump_hz"), reason, hint)


RMT_PULSE_NS_MIN = 500  # a channel reads its end mark meanwhile
# What a step takes in addition to its pulse and its pause, on an ESP32: with the RMT until the last axis has been
# started, with the SPI until two words have been given to it, else until the interrupt has seen that the time is over
# (tests/esp32/pulses.c).
SPREAD_NS = {"gpio": 250, "rmt": 1_000, "i2s": 0, "spi": 1_000}


def step_spread_ns(board: BoardFile) -> int:
    """What a step takes in addition to its pulse and its pause."""
    return SPREAD_NS[pulse_engine(board)] if board.target == "esp32" else 0


def _step_engine(board: BoardFile, chip: Chip) -> Iterator[Finding]:
    if board.step.engine != "rmt":
        return
    path, hint = ("step", "engine"), 'leave it out: "gpio" makes the pulses of any board'
    if chip.rmt is None:
        yield Finding("step-engine", path, f"{chip.name} has no RMT", hint)
        return
    # One for both motors of an axis: the GPIO matrix sends its signal to two pins.
    axes, led = len(board.axis.wired()), board.led is not None and board.led.kind == "ws2812"
    if axes + led > (channels := chip.rmt.tx_channels):
        light = " and the WS2812 another" if led else ""
        reason = f"{chip.name} has {channels} RMT channels that send, and {axes} axes want one each{light}"
        yield Finding("step-engine", path, reason, hint)
    elif board.timing.step_pulse_ns < RMT_PULSE_NS_MIN:
        reason = f"needs pulses of {RMT_PULSE_NS_MIN} ns, and timing.step_pulse_ns is {board.timing.step_pulse_ns}"
        yield Finding("step-engine", path, reason, hint)


def _memory(board: BoardFile, chip: Chip) -> Iterator[Finding]:
    """A wrong one would say that pins of the memory are free."""
    memory = board.memory
    if memory.mode not in chip.memory:
        known = "; ".join(f"{mode} = {what}" for mode, what in chip.memory.items())
        reason = f"{chip.name} has no memory variant {memory.mode!r}"
        yield Finding("memory-mode", ("memory", "mode"), reason, known)
        return
    for key in ("flash_mb", "psram_mb"):
        for index, size in enumerate(getattr(memory, key)):
            sizes = getattr(chip.memory_sizes[memory.mode], key)
            if size not in sizes:
                modes = [mode for mode, each in chip.memory_sizes.items() if size in getattr(each, key)]
                reason = f'{size} MB is none of memory variant "{memory.mode}", which has {_listed(sizes)}'
                hint = (
                    f"{size} MB is of {_listed(modes)}" if modes else "take what is printed on the module, such as N8R8"
                )
                yield Finding("memory-mode", ("memory", key, index), reason, hint)


def _listed(words: Iterable[object]) -> str:
    return ", ".join(map(str, words))


def _spi_host(board: BoardFile, chip: Chip) -> Iterator[Finding]:
    if board.ethernet and board.ethernet.spi_host not in chip.spi_hosts:
        hint = f"free for the W5500: {', '.join(chip.spi_hosts)}" if chip.spi_hosts else None
        reason = f"{chip.name} has no SPI host {board.ethernet.spi_host!r} for it"
        yield Finding("spi-host", ("ethernet", "spi_host"), reason, hint)


def _header_names(board: BoardFile, chip: Chip) -> Iterator[Finding]:
    for number, header in enumerate(board.header):
        for index, name in enumerate(header.pins):
            if name not in chip.pin and name not in NO_CHIP_PINS:
                reason = f"{name!r} is neither a pin of {chip.name} nor one of {', '.join(NO_CHIP_PINS)}"
                yield Finding("header-name", ("header", number, "pins", index), reason)


def _timer(board: BoardFile, chip: Chip) -> Iterator[Finding]:
    timing = board.timing
    if not chip.timer.makes(timing.timer_hz):
        reason = f"the step timer divides {chip.timer.clock_hz} Hz, which cannot make {timing.timer_hz} Hz"
        yield Finding("timer-hz", ("timing", "timer_hz"), reason)
    for key in ("step_pulse_ns", "dir_setup_ns"):
        ticks = getattr(timing, key) * timing.timer_hz / NS_PER_S
        if ticks != int(ticks):
            whole = ceil(ticks) * NS_PER_S / timing.timer_hz
            reason = f"{getattr(timing, key)} ns is {ticks:g} timer ticks; only whole ticks can be kept"
            yield Finding("timer-tick", ("timing", key), reason, f"next whole tick: {whole:g} ns")


def steps_of_events_hz(events_hz: int) -> int:
    """Each segment may have one event more than steps (core/machine/configure.c)."""
    return events_hz - min(events_hz // 4, SPARE_EVENTS_HZ)


def pulse_rate_hz(board: BoardFile, pulse_us: int = 0) -> int:
    """Steps a second with $0 at this. @param pulse_us  0: as the board starts"""
    timing = board.timing
    own_us = ceil(timing.step_pulse_ns / 1000)
    wanted_us = pulse_us or max(timing.default_pulse_us, own_us)
    pulse_ns = timing.step_pulse_ns if wanted_us == own_us else 1000 * wanted_us
    events_hz = NS_PER_S // (2 * on_grid_ns(board, pulse_ns) + step_spread_ns(board))
    return min(timing.max_step_rate_hz, steps_of_events_hz(events_hz))


def _default_pulse(board: BoardFile, chip: Chip) -> Iterator[Finding]:
    timing = board.timing
    if timing.default_pulse_us and 1000 * timing.default_pulse_us < timing.step_pulse_ns:
        reason = f"$0 cannot start at {timing.default_pulse_us} us: the shortest pulse is {timing.step_pulse_ns} ns"
        yield Finding("default-pulse", ("timing", "default_pulse_us"), reason, "leave it out, or make it longer")


def _pulse_timing(board: BoardFile, chip: Chip) -> Iterator[Finding]:
    timing = board.timing
    period_ns = NS_PER_S / timing.max_step_rate_hz
    low_ns = max(timing.step_pulse_ns, timing.dir_setup_ns)
    spread_ns = step_spread_ns(board)
    needed_ns = timing.step_pulse_ns + low_ns + spread_ns
    if needed_ns > period_ns:
        reason = (
            f"{timing.max_step_rate_hz} steps/s leave {period_ns:g} ns per step, but a pulse of "
            f"{timing.step_pulse_ns} ns and {low_ns} ns low (as long as the pulse, and the direction set up in it) "
            f"take {needed_ns} ns" + (f", {spread_ns} of them for the engine's own work" if spread_ns else "")
        )
        most_ns = (period_ns - spread_ns) / 2
        hint = f"at most {NS_PER_S // needed_ns} steps/s with this pulse, or a pulse of at most {most_ns:g} ns"
        yield Finding("pulse-timing", ("timing", "max_step_rate_hz"), reason, hint)


def _onboard(board: BoardFile, chip: Chip) -> Iterator[Finding]:
    for index, pin in enumerate(board.onboard):
        if pin not in chip.pin:
            meant = closest(pin, chip.pin)
            hint = f"did you mean {meant}?" if meant else None
            yield Finding("no-such-pin", ("onboard", index), f"{chip.name} has no pin {pin!r}", hint)


def _deviations(board: BoardFile, chip: Chip) -> Iterator[Finding]:
    for index, deviation in enumerate(board.deviation):
        if not _is_wire_or_time(deviation.key):
            reason = f"{deviation.key!r} is not a pin or a time of a board file"
            yield Finding("stale-deviation", ("deviation", index, "key"), reason, "such as axis.b.dir or input.misc[2]")
        elif board.value_of(deviation.key) == deviation.published:
            reason = f"{deviation.key} is {deviation.published} here too: this is not a deviation"
            yield Finding("stale-deviation", ("deviation", index), reason, "remove it, or correct its key")


def _is_wire_or_time(key: str) -> bool:
    """Whether a board file can have it, and a deviation can compare it."""
    here: Any = BoardFile
    for part in re.sub(r"\[(\d+)\]", r".\1", key).split("."):
        here = step_type(here, int(part) if part.isdecimal() else part)
    is_wire = isinstance(here, type) and issubclass(here, Wire | Led)
    return is_wire or key.removeprefix("timing.") in Timing.model_fields


# And the tables that they read, apart from the place that they name.
BOARD_RULES: dict[BoardRule, tuple[str, ...]] = {
    _used_once: (),
    _axes_contiguous: ("axis",),
    _one_kind_of_limit: (),
    _second_switch: ("axis",),
    _second_motor: ("axis",),
    _servo: (),
    _spindle_bus: (),
    _pendant: ("spindle_bus",),
    _dial: ("dial", "axis"),
    drivers: ("driver_bus", "driver", "axis", "spindle_bus", "pendant", "ethernet", "i2so", "step"),
    _charge_pump: ("output",),
    _step_engine: ("axis", "led", "timing"),
    shift_registers: ("step", "i2so", "timing", "ethernet"),
    _memory: (),
    _spi_host: (),
    _header_names: (),
    _onboard: ("i2so",),
    _timer: ("timing",),
    _pulse_timing: ("timing", "step", "i2so"),
    _default_pulse: ("timing",),
    _deviations: ("deviation", "axis", "timing", "output", "input"),
}
_PIN_TABLES = {
    "taken": ("memory",),
    "not-brought-out": ("header", "onboard"),
    "no-such-pin": ("i2so",),
    "stale-allow": ("memory", "header", "onboard"),
}


# ---- what would be legal instead -----------------------------------------------------------------------------------


def free_pins(board: BoardFile, chip: Chip, use: Use) -> list[str]:
    """Unused pins on which this use would break no rule, in the order of the chip's table."""
    busy = {other.pin for other in board.uses()} | set(board.onboard)
    return [pin for pin in chip.pin if pin not in busy and _is_clean(board, chip, use, pin)]


def spare_pins(board: BoardFile, chip: Chip) -> list[str]:
    """Unused pins that could become an output without an allow."""
    return free_pins(board, chip, Use("misc_out", ("output", "misc", 0), Role.MISC, OutputWire(pin="")))


def _is_clean(board: BoardFile, chip: Chip, use: Use, pin: str) -> bool:
    moved = replace(use, wire=use.wire.model_copy(update={"pin": pin}))
    return not any(list(rule(board, chip, moved)) for rule in USE_RULES)


def _free_pins_hint(board: BoardFile, chip: Chip, use: Use) -> str:
    pins = free_pins(board, chip, use)
    if not pins:
        return f"no free pin of this board is allowed for {use.signal} without an allow"
    more = f" and {len(pins) - HINT_PINS_MAX} more" if len(pins) > HINT_PINS_MAX else ""
    return f"free and legal for {use.signal}: {', '.join(pins[:HINT_PINS_MAX])}{more}"


def is_reachable(board: BoardFile, pin: str) -> bool:
    """A board without headers brings every pin out."""
    return not board.header or pin in board.onboard or any(pin in header.pins for header in board.header)
