"""The I/O expansion module, in virtual time: docs/protocol.md, "An I/O module"."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from pathlib import Path

import pytest
import wire_device
from test_motion import segment
from test_requests import config, configure
from test_session import reason
from wificnc.connection.wmc3.layout import (
    STATUS_PORT,
    Alarm,
    Capability,
    ChannelOutputs,
    ConfigSave,
    Estop,
    Handshake,
    HandshakeResponse,
    Hold,
    Home,
    IoControl,
    Jog,
    JogStop,
    Motion,
    ProbeLast,
    Refusal,
    Reset,
    State,
    Statistics,
    StatisticsResponse,
    StreamOpen,
    StreamOpened,
    Type,
    ValueType,
)  # fmt: skip
from wire_device import HOST, OTHER, Device

MODE, COUNT, DIRECTION, PULL_UP, INVERT, DEBOUNCE, LOST, LOST_MS, SAFE, FAULTS, PIN = (
    0x0600, 0x0610, 0x0611, 0x0612, 0x0613, 0x0614, 0x0615, 0x0616, 0x0617, 0x0618, 0x0620,
)  # fmt: skip
OPEN, LOW, HIGH = 0, 1, 2
# channels 0 .. 7 are inputs on pins 0 .. 7, 8 .. 15 outputs on pins 8 .. 15 ...
CONFIG = {COUNT: 16, DIRECTION: 0xFF00, **{PIN + n: n for n in range(16)}}
# ... and so that 0 .. 3 and 8 .. 11 are outputs
LOW_OUTPUTS = {**CONFIG, DIRECTION: 0x0F0F}
Make = Callable[..., "Module"]


class Module(Device):
    """A device that was configured by a host and started again as an I/O module."""

    def __init__(self, store: str, config: dict[int, int] | None = None, key: str = "") -> None:
        first = Device(store=store)
        client = first.connect()
        for number, value in {MODE: 1, **(CONFIG if config is None else config)}.items():
            assert configure(first, client, number, ValueType.U16, value) == Refusal.NONE
        assert reason(first, client, ConfigSave()) == Refusal.NONE
        first.close()
        super().__init__(key=key, store=store)

    def hold(self, pin: int, level: int) -> None:
        assert self.lib.host_wire_hold(self.wire, pin, level)

    @property
    def levels(self) -> int:
        """Of the pins that are outputs."""
        return int(self.lib.host_wire_levels(self.wire, ctypes.byref(ctypes.c_uint64())))

    @property
    def driven(self) -> int:
        pins = ctypes.c_uint64()
        self.lib.host_wire_levels(self.wire, ctypes.byref(pins))
        return pins.value

    def change(self, **values: int) -> None:
        """Set keys and save them."""
        client = self.connect()
        for name, value in values.items():
            assert configure(self, client, globals()[name], ValueType.U16, value) == Refusal.NONE
        assert reason(self, client, ConfigSave()) == Refusal.NONE

    def outputs(self, channels: int, on: int, address: str = HOST) -> None:
        self.send(ChannelOutputs(channels, on), address=address)

    def listen(self) -> None:
        self.send(JogStop(0xFF))


@pytest.fixture
def make(tmp_path: Path) -> Make:
    made: list[Module] = []

    def module(config: dict[int, int] | None = None, key: str = "") -> Module:
        made.append(Module(str(tmp_path / f"store{len(made)}"), config, key))
        return made[-1]

    yield module
    for each in made:
        each.close()


def inputs(module: Module, seconds: float = 0.1) -> int:
    module.listen()
    module.run(seconds)
    return module.status.io_inputs


# ---- start ----


def test_it_is_a_module_from_the_next_start_on(make: Make) -> None:
    module = make()
    hello = module.request(module.connect(), Handshake(0x01010000, "LinuxCNC IO Module")).payload
    assert isinstance(hello, HandshakeResponse)
    assert (hello.device_mode, hello.io_channels, hello.axes, hello.buffer_capacity) == (1, 16, 0, 0)
    assert hello.capabilities == Capability.IO_MODULE


def test_a_motion_controller_stays_one_until_then(device: Device) -> None:
    client = device.connect()
    assert configure(device, client, MODE, ValueType.U8, 1) == Refusal.NONE
    assert config(device, client, MODE)[1] == 1
    hello = device.request(client, Handshake()).payload
    assert isinstance(hello, HandshakeResponse) and hello.device_mode == 0
    assert reason(device, client, ChannelOutputs(1, 1)) == Refusal.UNKNOWN_TYPE
    device.motion(segment(100))
    device.run(0.5)
    assert device.pulses[0] == 100


def test_a_module_can_be_a_motion_controller_again(make: Make, tmp_path: Path) -> None:
    module = make()
    module.change(MODE=0)
    again = Device(store=str(tmp_path / "store0"))
    again.motion(segment(100))
    again.run(0.5)
    assert again.pulses[0] == 100
    again.close()


def test_without_channels_it_does_nothing(make: Make) -> None:
    module = make({COUNT: 0, DIRECTION: 0xFFFF, **{PIN + n: n for n in range(16)}})
    module.send(IoControl(misc_outputs=0xFF))
    assert (inputs(module), module.status.io_outputs, module.driven) == (0, 0, 0)


def test_outputs_start_in_their_safe_state(make: Make) -> None:
    plain = make({**CONFIG, INVERT: 0x0100})
    assert plain.driven == 0xFF00
    assert plain.levels == 0x0100, "an inverted output is off while its line is high"
    assert make({**CONFIG, SAFE: 0x0300, INVERT: 0x0100}).levels == 0x0200


# ---- inputs ----


def test_inputs_are_levels_pulled_up_and_inverted(make: Make) -> None:
    module = make({**CONFIG, PULL_UP: 0x000F, INVERT: 0x00CC})
    module.hold(0, LOW)
    module.hold(2, LOW)
    module.hold(5, HIGH)
    module.hold(6, HIGH)
    # 0 low, 1 pulled up, 2 low and inverted, 3 pulled up and inverted, 4 open, 5 high, 6 high and inverted, 7 open and
    # inverted
    assert inputs(module) == 0b10100110


@pytest.mark.parametrize("debounce_ms", [1, 10, 60])
def test_an_input_counts_when_it_has_stood(make: Make, debounce_ms: int) -> None:
    module = make({**CONFIG, PULL_UP: 0, DEBOUNCE: debounce_ms})
    module.change()  # nothing: it only shows that saving disturbs no input
    client = module.connect()
    assert configure(module, client, 0x0103, ValueType.U16, 10) == Refusal.NONE  # a report every 10 ms
    for _ in range(20):  # bounces shorter than that
        module.hold(3, HIGH)
        module.run(debounce_ms * 0.4e-3)
        module.hold(3, OPEN)
        module.run(debounce_ms * 0.4e-3)
    assert inputs(module, 0.02) == 0
    module.hold(3, HIGH)
    module.run(debounce_ms * 1e-3 + 0.013)
    assert module.status.io_inputs == 8
    module.hold(3, LOW)
    module.run(debounce_ms * 1e-3 + 0.013)
    assert module.status.io_inputs == 0


def test_outputs_are_no_inputs(make: Make) -> None:
    module = make()
    for pin in range(16):
        module.hold(pin, HIGH)
    assert inputs(module) == 0x00FF


# ---- outputs ----


def test_io_control_switches_the_low_channels(make: Make) -> None:
    module = make(LOW_OUTPUTS)
    module.send(IoControl(misc_outputs=0xFA, spindle=1, rpm=1000, coolant=3))
    module.run(0.06)
    assert (module.levels, module.status.io_outputs) == (0x0A, 0x0A), "inputs among them are left out"
    assert (module.status.spindle, module.status.coolant, module.status.rpm) == (0, 0, 0)


def test_some_outputs_are_switched_and_others_stay(make: Make) -> None:
    module = make(LOW_OUTPUTS)
    client = module.connect()
    assert reason(module, client, ChannelOutputs(0x0F00, 0x0500)) == Refusal.NONE
    assert reason(module, client, ChannelOutputs(0x0301, 0x0201)) == Refusal.NONE
    module.run(0.06)
    assert module.levels == 0x0601
    assert reason(module, client, ChannelOutputs(0x0010, 0)) == Refusal.NOT_OUTPUT
    assert reason(module, client, ChannelOutputs(0x0110, 0x0110)) == Refusal.NOT_OUTPUT
    assert module.levels == 0x0601, "what is refused changes nothing"
    module.send(IoControl(misc_outputs=0))
    assert module.levels == 0x0600


def test_one_host_commands(make: Make) -> None:
    module = make()
    module.outputs(0x0100, 0x0100)
    module.outputs(0x0200, 0x0200, address=OTHER)
    assert reason(module, module.connect(OTHER), ChannelOutputs(0x0200, 0x0200)) == Refusal.OWNER
    assert module.levels == 0x0100


def test_an_access_key_locks_outputs(make: Make) -> None:
    module = make(key="secret")
    client = module.connect()
    module.outputs(0x0100, 0x0100)
    assert reason(module, client, ChannelOutputs(0x0100, 0x0100)) == Refusal.AUTHENTICATION
    assert configure(module, client, SAFE, ValueType.U16, 0xFF00) == Refusal.AUTHENTICATION
    assert module.levels == 0
    assert module.prove(client, "secret") == Refusal.NONE
    module.outputs(0x0100, 0x0100)
    assert module.levels == 0x0100


# ---- the link ----


def test_outputs_go_to_their_safe_state_when_the_host_is_silent(make: Make) -> None:
    module = make({**CONFIG, SAFE: 0x0200, LOST_MS: 300})
    module.outputs(0x0300, 0x0100)
    for _ in range(5):
        module.run(0.25)
        module.listen()  # any datagram is a sign of life
    assert module.levels == 0x0100
    module.run(0.29)
    assert module.levels == 0x0100
    module.run(0.02)
    assert module.levels == 0x0200
    module.outputs(0x0200, 0, address=OTHER)
    assert module.levels == 0, "another host may command now"


def test_a_connection_is_a_sign_of_life(make: Make) -> None:
    """LinuxCNC's component sends outputs when they change, and else nothing; its connection stays."""
    module = make({**CONFIG, LOST_MS: 300})
    client = module.connect()
    module.outputs(0x0100, 0x0100)
    module.run(100)
    assert module.levels == 0x0100
    module.disconnect(client)
    module.run(0.002)
    assert module.levels == 0


def test_the_connection_that_keeps_outputs_is_taken_from_nobody(make: Make) -> None:
    """A fifth client may take a place that was silent for 30 s; LinuxCNC's is always silent."""
    module = make({**CONFIG, LOST_MS: 300})
    module.connect()
    module.outputs(0x0100, 0x0100)
    module.run(31)
    assert [module.connect(OTHER) for _ in range(4)] == [1, 2, 3, -1]
    module.run(1)
    assert module.levels == 0x0100


def test_outputs_may_be_told_to_stay(make: Make) -> None:
    module = make({**CONFIG, LOST: 0})
    module.outputs(0x0100, 0x0100)
    module.run(100)
    assert module.levels == 0x0100
    module.outputs(0x0200, 0x0200, address=OTHER)
    assert module.levels == 0x0300


def test_the_silence_of_others_is_none(make: Make) -> None:
    module = make({**CONFIG, LOST_MS: 300})
    module.send(JogStop(0xFF), address=OTHER)
    module.outputs(0x0100, 0x0100)
    for _ in range(10):
        module.run(0.2)
        module.outputs(0x0100, 0x0100)
    assert module.levels == 0x0100


# ---- stops ----


def test_an_estop_is_for_everybody_and_only_a_reset_leads_on(make: Make) -> None:
    module = make({**CONFIG, SAFE: 0x8000}, key="secret")
    client = module.connect()
    assert module.prove(client, "secret") == Refusal.NONE
    module.outputs(0xFF00, 0x0100)
    for _ in range(3):
        module.send(Estop(), address=OTHER)
    assert module.levels == 0x8000
    module.outputs(0xFF00, 0x0100)
    assert reason(module, client, ChannelOutputs(0x0100, 0x0100)) == Refusal.LOCKED
    module.run(0.06)
    assert (module.levels, module.status.state, module.status.alarm) == (0x8000, State.ESTOP, Alarm.ESTOP)
    module.send(Reset(), address=OTHER)
    assert reason(module, client, ChannelOutputs(0x0100, 0x0100)) == Refusal.LOCKED, "OTHER is not authenticated"
    module.send(Reset())
    module.outputs(0xFF00, 0x0100)
    module.run(0.06)
    assert (module.levels, module.status.state, module.status.alarm) == (0x0100, State.IDLE, Alarm.NONE)


@pytest.mark.parametrize("payload", [Jog(0, 1, 100), Home(1), Hold()])
def test_it_moves_nothing(make: Make, payload: Jog | Home | Hold) -> None:
    module = make()
    assert reason(module, module.connect(), payload) == Refusal.IO_MODULE
    module.send(payload)
    module.run(0.2)
    assert (module.status.state, module.pulses) == (State.IDLE, [0] * 6)
    assert not module.of_type(Type.HOME_COMPLETE)


def test_it_has_no_probe(make: Make) -> None:
    module = make()
    assert reason(module, module.connect(), ProbeLast()) == Refusal.IO_MODULE


def test_it_takes_no_motion(make: Make) -> None:
    module = make()
    client = module.connect()
    module.send(Motion(count=2), (segment(100), segment(100)))
    opened = module.request(client, StreamOpen()).payload
    assert isinstance(opened, StreamOpened) and (opened.stream, opened.refusal) == (0, Refusal.IO_MODULE)
    module.run(0.5)
    counts = module.request(client, Statistics()).payload
    assert isinstance(counts, StatisticsResponse)
    assert (counts.refused_segments, counts.last_refusal) == (2, Refusal.IO_MODULE)
    assert module.pulses == [0] * 6


# ---- reports ----


def test_reports_come_at_both_ports(make: Make) -> None:
    """LinuxCNC's component hears an I/O module at a port of its own."""
    module = make()
    module.listen()
    assert [sent.port for sent in module.of_type(Type.STATUS)] == [STATUS_PORT, 58430]
    module.sent.clear()
    module.run(1.0)
    ports = [sent.port for sent in module.of_type(Type.STATUS)]
    assert ports.count(STATUS_PORT) == pytest.approx(20, abs=1) and ports.count(58430) == ports.count(STATUS_PORT)
    assert all(len(sent.data) == 80 for sent in module.of_type(Type.STATUS))


# ---- configuration ----


def test_lines_change_with_save_and_not_before(make: Make) -> None:
    module = make()
    module.outputs(0x0300, 0x0300)
    client = module.connect()
    for key, value in {DIRECTION: 0xFE01, INVERT: 0x0400, PIN + 9: 40}.items():
        assert configure(module, client, key, ValueType.U16, value) == Refusal.NONE
        assert (module.driven, module.levels) == (0xFF00, 0x0300)
    assert reason(module, client, ConfigSave()) == Refusal.NONE
    assert module.driven == 0xFC01 | 1 << 40
    assert module.levels == 0x0400, "8 is no output any more, 9 has a new pin: safe; 10 is inverted"


def test_saving_does_not_disturb_outputs(make: Make) -> None:
    module = make()
    module.outputs(0x0300, 0x0300)
    module.change(SAFE=0x0400)
    assert module.levels == 0x0300


@pytest.mark.parametrize(
    ("values", "why"),
    [
        ({PIN + 15: 60}, "pins from 60 on are inputs only"),
        ({PIN + 1: 64}, "there is no such pin"),
        ({PIN + 1: 0}, "channel 0 has it"),
        ({DIRECTION: 0x0080, PIN + 7: 61}, "together they cannot be"),
    ],
)
def test_what_cannot_be_is_refused_and_nothing_kept(make: Make, values: dict[int, int], why: str) -> None:
    module = make()
    client = module.connect()
    for key, value in values.items():
        assert configure(module, client, key, ValueType.U16, value) == Refusal.NONE
    assert reason(module, client, ConfigSave()) == Refusal.PIN, why
    assert module.driven == 0xFF00


@pytest.mark.parametrize(
    ("key", "value"), [(MODE, 2), (COUNT, 17), (DEBOUNCE, 61), (LOST, 2), (LOST_MS, 99), (LOST_MS, 60001), (PIN, 256)]
)
def test_values_out_of_range(make: Make, key: int, value: int) -> None:
    module = make()
    client = module.connect()
    before = config(module, client, key)
    assert configure(module, client, key, ValueType.U32, value) == Refusal.RANGE
    assert configure(module, client, key, ValueType.I32, -1) == Refusal.RANGE
    assert config(module, client, key) == before
    assert configure(module, client, FAULTS, ValueType.U16, 0) == Refusal.READ_ONLY


def test_defaults(device: Device) -> None:
    client = device.connect()
    keys = (MODE, COUNT, DIRECTION, PULL_UP, INVERT, DEBOUNCE, LOST, LOST_MS, SAFE, FAULTS, PIN, PIN + 15)
    expected = [0, 0, 0, 0xFFFF, 0, 10, 1, 1000, 0, 0, 255, 255]
    assert [config(device, client, key)[1] for key in keys] == expected


def test_settings_of_the_motion_controller_are_kept_in_both_modes(
    make: Make, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    module = make()
    client = module.connect()
    assert config(module, client, 0x0001)[1] == 200.0, "what was stored before"
    assert configure(module, client, 0x0001, ValueType.FLOAT, 80.0) == Refusal.NONE
    module.change(MODE=0)
    monkeypatch.setattr(wire_device, "SETTINGS", {})
    again = Device(store=str(tmp_path / "store0"))
    assert config(again, again.connect(), 0x0001)[1] == 80.0
    again.close()
