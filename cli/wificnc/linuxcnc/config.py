"""A LinuxCNC configuration from a machine profile: file name -> text. Pure."""

from __future__ import annotations

import re

from wificnc.files import paths
from wificnc.linuxcnc.source import PROGRAM
from wificnc.profile.model import LinearAxis, Machine, RotaryAxis, Value
from wificnc.tables import AXES, load_settings

OUTPUT_COUNT, INPUT_COUNT = 5, 4  # digital pins of the component (linuxcnc/pins.h)
KEY_FILE = "access.key"  # next to the INI file
SAMPLES = 1000  # servo periods that wait for the component, should it not get its turn

QUEUE_MS = 100
NETWORK_S = 0.05  # a report may be so much longer on its way
WAIT_S = 0.15  # with a queue of QUEUE_MS the component has LinuxCNC wait when so much more is not confirmed (motion.c)
LOST_REPORTS = 2  # in a row, while it slows down: with 30 % loss 3 of 100 such stops lose more
MARGIN = 0.2  # units
ENDLESS = 1e9
MESSAGE = re.compile(r'^MESSAGE\((\w+), "([\w-]+)", "([^"]+)"\)$', re.MULTILINE)

INI = """\
# LinuxCNC configuration for {name}, written by `wificnc linuxcnc init`. docs/linuxcnc.md explains it.
[EMC]
VERSION = 1.1
MACHINE = {name}
DEBUG = 0

[DISPLAY]
DISPLAY = axis
POSITION_OFFSET = RELATIVE
POSITION_FEEDBACK = ACTUAL
MAX_FEED_OVERRIDE = 2.0
MAX_LINEAR_VELOCITY = {fastest:g}
PROGRAM_PREFIX = nc_files
INTRO_GRAPHIC = linuxcnc.gif

[TASK]
TASK = milltask
CYCLE_TIME = 0.010

[RS274NGC]
PARAMETER_FILE = {name}.var

[EMCMOT]
EMCMOT = motmod
COMM_TIMEOUT = 1.0
SERVO_PERIOD = 1000000

[EMCIO]
EMCIO = io
CYCLE_TIME = 0.100
TOOL_TABLE = {name}.tbl

[HAL]
# halui unhomes joints when the controller has lost its position
HALUI = halui
HALFILE = {name}.hal

[WIFICNC]
ADDRESS = {address}
# `wificnc linuxcnc pair` stores the controller's access key there
KEY_FILE = {key_file}
# motion that waits in the controller, so that a late packet does not stop the machine
QUEUE_MS = {queue_ms}
# run-up time of a spindle without an encoder
RUN_UP_S = 3

# Following error. The feedback is late by QUEUE_MS, a status report ($76 of the controller, {report_ms} ms) and the
# network ({network_ms} ms): {lag_s:g} s in all; and {worst_s:g} s before LinuxCNC, which waits for a network that loses
# motion or reports, has slowed down. LinuxCNC allows FERROR at top speed, in proportion less at lower speed, and
# never less than MIN_FERROR:
#   FERROR      {worst_s:g} s of top speed, and the way to stop
#   MIN_FERROR  the way that the machine still has to go when the command has just stopped
# At rest the component compares command and position itself, to the step. If you make QUEUE_MS or $76 larger,
# make both larger in proportion.

[KINS]
KINEMATICS = trivkins coordinates={letters}
JOINTS = {count}

[TRAJ]
COORDINATES = {letters}
LINEAR_UNITS = mm
ANGULAR_UNITS = degree
DEFAULT_LINEAR_VELOCITY = {slow:g}
MAX_LINEAR_VELOCITY = {fastest:g}
"""

JOINT_INI = """
[AXIS_{letter}]
MIN_LIMIT = {low:g}
MAX_LIMIT = {high:g}
MAX_VELOCITY = {velocity:g}
MAX_ACCELERATION = {acceleration:g}

[JOINT_{joint}]
TYPE = {type}
MIN_LIMIT = {low:g}
MAX_LIMIT = {high:g}
MAX_VELOCITY = {velocity:g}
MAX_ACCELERATION = {acceleration:g}
SCALE = {scale:g}
FERROR = {ferror:.4g}
MIN_FERROR = {min_ferror:.4g}
# {home_comment}
HOME = {home:g}
HOME_OFFSET = 0
HOME_SEARCH_VEL = 0
HOME_LATCH_VEL = {latch:g}
HOME_USE_INDEX = {index}
HOME_SEQUENCE = 0
"""
HOME_COMMENTS = {
    True: "Homing: the controller finds its own switches; to LinuxCNC the end of that looks like an index pulse.",
    False: "Homing: no switch. Home takes the present position as HOME: move the axis to its zero first.",
}
LATCH_SPEED = 0.001  # units/s: LinuxCNC's command meanwhile hardly moves, and nothing follows it

HAL_HEAD = """\
# HAL of {name}, written by `wificnc linuxcnc init`. docs/linuxcnc.md describes the pins of wificnc.
loadrt [KINS]KINEMATICS
loadrt [EMCMOT]EMCMOT servo_period_nsec=[EMCMOT]SERVO_PERIOD num_joints=[KINS]JOINTS num_dio={outputs}
loadrt not count=2
loadrt or2 count=1
loadrt integ count=1
loadrt estop_latch count=1
loadrt sampler depth={samples} cfg={kinds}
# what LinuxCNC's screen shows when the controller has a problem; one text for each name
loadrt message names={names} messages="{texts}"
loadusr -Wn wificnc {program} --address [WIFICNC]ADDRESS --joints {count} \\
    --queue-ms [WIFICNC]QUEUE_MS --run-up-s [WIFICNC]RUN_UP_S --key-file [WIFICNC]KEY_FILE
addf motion-command-handler servo-thread
addf motion-controller servo-thread
addf integ.0 servo-thread
addf sampler.0 servo-thread
addf not.0 servo-thread
addf or2.0 servo-thread
addf not.1 servo-thread
addf estop-latch.0 servo-thread
"""

HAL_MESSAGE = """\
addf say-{name} servo-thread
net say-{name} wificnc.message.{name} => say-{name}.trigger
"""

HAL_JOINT = """
setp wificnc.joint.{joint}.scale [JOINT_{joint}]SCALE
net cmd-{joint} joint.{joint}.motor-pos-cmd => sampler.0.pin.{joint}
net fb-{joint} wificnc.joint.{joint}.position-fb => joint.{joint}.motor-pos-fb
net home-{joint} joint.{joint}.index-enable <=> wificnc.joint.{joint}.index-enable
net homed-{joint} joint.{joint}.homed => wificnc.joint.{joint}.homed
net unhome-{joint} wificnc.joint.{joint}.unhome => halui.joint.{joint}.unhome
"""

HAL_TAIL = """
# The sampler hands every servo period to the component: commanded positions, time in s, and the kind of motion (G38)
setp integ.0.in 1
net servo-time integ.0.out => sampler.0.pin.{count}
net motion-type motion.motion-type => sampler.0.pin.{type_pin}

# Machine on starts motion. A fault of the component switches the machine off, and so does a component that has ended:
# then the sampler is not read, and it is full after 1 s
net machine-on joint.0.amp-enable-out => wificnc.enable
net fault wificnc.fault => or2.0.in0
net sampler-full sampler.0.full => or2.0.in1
net stops or2.0.out => not.1.in
net no-fault not.1.out => motion.enable

# Programs wait while the controller is in a feed hold or its door is open, or while the network is too slow
net feed-inhibit wificnc.feed-inhibit => motion.feed-inhibit

net spindle-on spindle.0.on => wificnc.spindle-on
net spindle-reverse spindle.0.reverse => wificnc.spindle-reverse
net spindle-rpm spindle.0.speed-out-abs => wificnc.spindle-rpm
# G1 waits until the spindle is at speed. G33, G33.1 and G76 need an encoder at the controller
net spindle-at-speed wificnc.spindle-at-speed => spindle.0.at-speed
net spindle-speed wificnc.spindle-speed-rps => spindle.0.speed-in
net spindle-revs wificnc.spindle-revs => spindle.0.revs
net spindle-index spindle.0.index-enable <=> wificnc.spindle-index-enable
net flood iocontrol.0.coolant-flood => wificnc.flood
net mist iocontrol.0.coolant-mist => wificnc.mist
{digital}

# G38: the controller stops at the contact by itself and measures it to the step
net probe wificnc.probe => motion.probe-input

# E-stop (F1). LinuxCNC's stops the controller. The controller's e-stop, an alarm, a lost connection or a lost position
# open the latch, and only F1 closes it again: it resets the controller first.
# This is software. Wire an e-stop that cuts the power of the drives.
net user-enable iocontrol.0.user-enable-out => not.0.in
net user-estop not.0.out => wificnc.estop estop-latch.0.fault-in
net controller-ok wificnc.estop-ok => estop-latch.0.ok-in
net reset-request iocontrol.0.user-request-enable => wificnc.reset
net reset-done wificnc.reset-done => estop-latch.0.reset
net estop-ok estop-latch.0.ok-out => iocontrol.0.emc-enable-in

# M6 asks for the tool, and waits until Continue is pressed. With a tool changer connect it here instead
loadusr -W hal_manualtoolchange
net tool-change iocontrol.0.tool-change => hal_manualtoolchange.change
net tool-changed hal_manualtoolchange.changed => iocontrol.0.tool-changed
net tool-number iocontrol.0.tool-prep-number => hal_manualtoolchange.number
net tool-prepare iocontrol.0.tool-prepare => iocontrol.0.tool-prepared

# Messages on the screen
"""


def files(name: str, address: str, machine: Machine, homes: bool | None = None) -> dict[str, str]:
    """All files of a configuration. Raises ValueError when the axes are not X, Y ... without a gap.

    homes: the controller homes to switches; None: when the profile switches that on."""
    axes = list(machine.axis.present())
    if not axes or [index for index, _ in axes] != list(range(len(axes))):
        raise ValueError("joint n is the controller's axis n: the machine needs axes from X on without a gap")
    homes = bool(machine.homing.enabled) if homes is None else homes
    joints = [_joint(index, axis) | _homing(machine, axis, homes) for index, axis in axes]
    fastest = max(float(joint["velocity"]) for joint in joints)
    letters = "".join(str(joint["letter"]) for joint in joints)
    values = {"name": name, "address": address, "letters": letters, "count": len(joints), "fastest": fastest}
    ini = INI.format(**values, key_file=KEY_FILE, slow=fastest / 4, **_lags()) + "".join(
        JOINT_INI.format(**joint) for joint in joints
    )
    texts = messages()
    sampler = {"samples": SAMPLES, "kinds": "f" * len(joints) + "fs", "program": PROGRAM}
    shown = {"names": ",".join(f"say-{name}" for name in texts), "texts": ",".join(texts.values())}
    hal = HAL_HEAD.format(**values, **sampler, **shown, outputs=OUTPUT_COUNT)
    hal += "".join(HAL_JOINT.format(**joint) for joint in joints)
    hal += HAL_TAIL.format(digital=_digital(), count=len(joints), type_pin=len(joints) + 1)
    hal += "".join(HAL_MESSAGE.format(name=name) for name in texts)
    return {f"{name}.ini": ini, f"{name}.hal": hal, f"{name}.tbl": "T1 P1 D0 Z0 ;\n"}


def messages() -> dict[str, str]:
    """What the component shows to the operator: names of its pins behind `message.`, and texts."""
    table = (paths.ROOT / "linuxcnc" / "messages.def").read_text(encoding="utf-8")
    return {name: text for _, name, text in MESSAGE.findall(table)}


def _report_s() -> float:
    return float(load_settings()["status_interval_ms"].default) / 1000


def _lag_s() -> float:
    """By so much the feedback is behind the command."""
    return QUEUE_MS / 1000 + _report_s() + NETWORK_S


def _worst_s() -> float:
    """By so much it may be before LinuxCNC, which waits then, has slowed down."""
    return _lag_s() + WAIT_S + LOST_REPORTS * _report_s()


def _lags() -> dict[str, float]:
    """For the comment that explains it."""
    times = {"report_ms": round(_report_s() * 1000), "network_ms": round(NETWORK_S * 1000)}
    return {**times, "lag_s": _lag_s(), "worst_s": _worst_s(), "queue_ms": QUEUE_MS}


def following_error(velocity: float, acceleration: float) -> tuple[float, float]:
    """FERROR and MIN_FERROR of a joint. LinuxCNC allows FERROR v / velocity at speed v, at least MIN_FERROR.

    Before the feedback is later than _worst_s(), for want of motion or of reports, the component has had LinuxCNC wait.
    While the command slows down to speed v, a feedback that is late by T is behind by at most v T + `rest`, where
    `rest` is the way of the last T before the stop, and never by more than at top speed. So MIN_FERROR is what that is
    where it meets LinuxCNC's line."""
    lag_s = _worst_s()
    stop_s = min(lag_s, velocity / acceleration)
    rest = acceleration * stop_s * (lag_s - stop_s / 2)
    most = velocity * lag_s + velocity**2 / (2 * acceleration)
    least = min(rest / (1 - velocity * lag_s / most), velocity * lag_s)
    return most + MARGIN, least + MARGIN


def _digital() -> str:
    """Outputs P0 .. of M62 to M65, inputs of M66."""
    lines = [f"net dout-{n} motion.digital-out-{n:02} => wificnc.digital-out-{n:02}" for n in range(OUTPUT_COUNT)]
    lines += [f"net din-{n} wificnc.digital-in-{n:02} => motion.digital-in-{n:02}" for n in range(INPUT_COUNT)]
    return "\n".join(lines)


def _travel(axis: LinearAxis | RotaryAxis) -> float:
    """What the profile leaves out is the controller's default."""
    values = dict(axis.assigned())
    return float(values.get("max_travel_mm", load_settings()["max_travel_mm"].default))


def _homing(machine: Machine, axis: LinearAxis | RotaryAxis, homes: bool) -> dict[str, Value | str]:
    """HOME is where the controller is when it has homed, so that LinuxCNC has nowhere to go then."""
    travel, homes = _travel(axis), homes and _travel(axis) > 0
    pull_off = machine.homing.pull_off_mm
    if pull_off is None:
        pull_off = float(load_settings()["homing_pull_off_mm"].default)
    at_end = -travel + pull_off if axis.home_at == "min" else -pull_off
    return {
        "home": at_end if homes else 0.0,
        "latch": LATCH_SPEED if homes else 0.0,
        "index": "YES" if homes else "NO",
        "home_comment": HOME_COMMENTS[homes],
    }


def _joint(index: int, axis: LinearAxis | RotaryAxis) -> dict[str, Value | str]:
    """Velocities in units/s, as LinuxCNC has them."""
    values = {name: float(value) for name, value in axis.assigned()}
    travel = _travel(axis)
    velocity, acceleration = values["max_rate_mm_min"] / 60, values["acceleration_mm_s2"]
    most, least = following_error(velocity, acceleration)
    return {
        "joint": index,
        "letter": AXES[index],
        "type": "LINEAR" if isinstance(axis, LinearAxis) else "ANGULAR",
        "low": -travel if travel else -ENDLESS,
        "high": 0.0 if travel else ENDLESS,
        "velocity": velocity,
        "acceleration": acceleration,
        "scale": values["steps_per_mm"],
        "ferror": most,
        "min_ferror": least,
    }
