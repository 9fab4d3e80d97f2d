"""A LinuxCNC configuration from a machine profile: file name -> text. Pure."""

from __future__ import annotations

from wificnc.linuxcnc.source import PROGRAM
from wificnc.machine.model import LinearAxis, Machine, RotaryAxis, Value
from wificnc.protocol import AXES, load_settings

OUTPUT_COUNT, INPUT_COUNT = 5, 4  # digital pins of the component (linuxcnc/pins.h)
SAMPLES = 1000  # servo periods that wait for the component, should it not get its turn

# The controller runs behind by its queue, and its reports by their interval: so much of a second.
LAG_S = 0.5
ENDLESS = 1e9

INI = """\
# LinuxCNC configuration for {name}, written by `wificnc linuxcnc init`. docs/linuxcnc.md says what is what.
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
HALFILE = {name}.hal

[WIFICNC]
ADDRESS = {address}
QUEUE_MS = 100
# of a spindle without an encoder
RUN_UP_S = 3

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
# what the controller's queue and reports are behind at full speed
FERROR = {ferror:g}
MIN_FERROR = {ferror:g}
# {home_comment}
HOME = {home:g}
HOME_OFFSET = 0
HOME_SEARCH_VEL = 0
HOME_LATCH_VEL = {latch:g}
HOME_USE_INDEX = {index}
HOME_SEQUENCE = 0
"""
HOME_COMMENTS = {
    True: "the controller homes to its own switches, while LinuxCNC believes to wait for an index pulse",
    False: "homed where it stands",
}
LATCH_SPEED = 0.001  # units/s: LinuxCNC's command meanwhile hardly moves, and nothing follows it

HAL_HEAD = """\
# HAL of {name}, written by `wificnc linuxcnc init`.
loadrt [KINS]KINEMATICS
loadrt [EMCMOT]EMCMOT servo_period_nsec=[EMCMOT]SERVO_PERIOD num_joints=[KINS]JOINTS num_dio={outputs}
loadrt not count=1
loadrt integ count=1
loadrt sampler depth={samples} cfg={kinds}
loadusr -Wn wificnc {program} --address [WIFICNC]ADDRESS --joints {count} \\
    --queue-ms [WIFICNC]QUEUE_MS --run-up-s [WIFICNC]RUN_UP_S
addf motion-command-handler servo-thread
addf motion-controller servo-thread
addf integ.0 servo-thread
addf sampler.0 servo-thread
addf not.0 servo-thread
"""

HAL_JOINT = """
setp wificnc.joint.{joint}.scale [JOINT_{joint}]SCALE
net cmd-{joint} joint.{joint}.motor-pos-cmd => sampler.0.pin.{joint}
net fb-{joint} wificnc.joint.{joint}.position-fb => joint.{joint}.motor-pos-fb
net home-{joint} joint.{joint}.index-enable <=> wificnc.joint.{joint}.index-enable
"""

HAL_TAIL = """
# the sampler keeps each servo period for the component: commanded positions, the thread's own time in s, and whether it
# is one of G38
setp integ.0.in 1
net servo-time integ.0.out => sampler.0.pin.{count}
net motion-type motion.motion-type => sampler.0.pin.{type_pin}

# switched on by the first joint's amplifier; a fault of the link switches all of them off
net machine-on joint.0.amp-enable-out => wificnc.enable
net link-fault wificnc.fault => {faults}

net spindle-on spindle.0.on => wificnc.spindle-on
net spindle-reverse spindle.0.reverse => wificnc.spindle-reverse
net spindle-rpm spindle.0.speed-out-abs => wificnc.spindle-rpm
# the encoder, where the controller has one: G33, G33.1, G76; and feed moves wait until the spindle has its speed
net spindle-at-speed wificnc.spindle-at-speed => spindle.0.at-speed
net spindle-speed wificnc.spindle-speed-rps => spindle.0.speed-in
net spindle-revs wificnc.spindle-revs => spindle.0.revs
net spindle-index spindle.0.index-enable <=> wificnc.spindle-index-enable
net flood iocontrol.0.coolant-flood => wificnc.flood
net mist iocontrol.0.coolant-mist => wificnc.mist
{digital}

# G38 stops at the controller's own contact, and measures it to the step
net probe wificnc.probe => motion.probe-input

# e-stop: ours stops the controller; the controller's, and a lost link, stop us; leaving it resets the controller
net user-enable iocontrol.0.user-enable-out => not.0.in
net user-estop not.0.out => wificnc.estop
net user-request iocontrol.0.user-request-enable => wificnc.reset
net device-fine wificnc.estop-ok => iocontrol.0.emc-enable-in

net tool-change iocontrol.0.tool-change => iocontrol.0.tool-changed
net tool-prepare iocontrol.0.tool-prepare => iocontrol.0.tool-prepared
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
    ini = INI.format(**values, slow=fastest / 4) + "".join(JOINT_INI.format(**joint) for joint in joints)
    faults = " ".join(f"joint.{n}.amp-fault-in" for n in range(len(joints)))
    sampler = {"samples": SAMPLES, "kinds": "f" * len(joints) + "fs", "program": PROGRAM}
    hal = HAL_HEAD.format(**values, **sampler, outputs=OUTPUT_COUNT)
    hal += "".join(HAL_JOINT.format(**joint) for joint in joints)
    hal += HAL_TAIL.format(faults=faults, digital=_digital(), count=len(joints), type_pin=len(joints) + 1)
    return {f"{name}.ini": ini, f"{name}.hal": hal, f"{name}.tbl": "T1 P1 D0 Z0 ;\n"}


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
    """HOME is where the controller stands when it has homed, so that LinuxCNC has nowhere to go then."""
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
    velocity = values["max_rate_mm_min"] / 60
    return {
        "joint": index,
        "letter": AXES[index],
        "type": "LINEAR" if isinstance(axis, LinearAxis) else "ANGULAR",
        "low": -travel if travel else -ENDLESS,
        "high": 0.0 if travel else ENDLESS,
        "velocity": velocity,
        "acceleration": values["acceleration_mm_s2"],
        "scale": values["steps_per_mm"],
        "ferror": velocity * LAG_S + 1.0,
    }
