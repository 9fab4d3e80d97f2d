"""A LinuxCNC configuration from a machine profile: file name -> text. Pure."""

from __future__ import annotations

from wificnc.linuxcnc.component import OUTPUT_COUNT
from wificnc.machine.model import Axes, LinearAxis, RotaryAxis, Value
from wificnc.protocol import AXES, load_settings

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
# homed where it stands: home with the controller before ($H, wificnc wmc3 home)
HOME = 0
HOME_OFFSET = 0
HOME_SEARCH_VEL = 0
HOME_LATCH_VEL = 0
HOME_SEQUENCE = 0
"""

HAL_HEAD = """\
# HAL of {name}, written by `wificnc linuxcnc init`.
loadrt [KINS]KINEMATICS
loadrt [EMCMOT]EMCMOT servo_period_nsec=[EMCMOT]SERVO_PERIOD num_joints=[KINS]JOINTS num_dio={outputs}
loadrt not count=2
loadrt integ count=1
loadusr -Wn wificnc python3 -m wificnc.linuxcnc --address [WIFICNC]ADDRESS --joints {count} --queue-ms [WIFICNC]QUEUE_MS
addf motion-command-handler servo-thread
addf motion-controller servo-thread
addf integ.0 servo-thread
addf not.0 servo-thread
addf not.1 servo-thread
"""

HAL_JOINT = """
setp wificnc.joint.{joint}.scale [JOINT_{joint}]SCALE
net cmd-{joint} joint.{joint}.motor-pos-cmd => wificnc.joint.{joint}.position-cmd
net fb-{joint} wificnc.joint.{joint}.position-fb => joint.{joint}.motor-pos-fb
"""

HAL_TAIL = """
# the servo thread's own time, s: positions and time then fit, however late the component gets its turn
setp integ.0.in 1
net servo-time integ.0.out => wificnc.servo-time

# switched on by the first joint's amplifier; a fault of the link switches all of them off
net machine-on joint.0.amp-enable-out => wificnc.enable
net link-fault wificnc.fault => {faults}

net spindle-on spindle.0.on => wificnc.spindle-on
net spindle-reverse spindle.0.reverse => wificnc.spindle-reverse
net spindle-rpm spindle.0.speed-out-abs => wificnc.spindle-rpm
net flood iocontrol.0.coolant-flood => wificnc.flood
net mist iocontrol.0.coolant-mist => wificnc.mist
{digital}
net probe wificnc.probe => motion.probe-input

# e-stop: ours stops the controller, the controller's stops us; leaving it resets the controller
net user-enable iocontrol.0.user-enable-out => not.0.in
net user-estop not.0.out => wificnc.estop
net user-request iocontrol.0.user-request-enable => wificnc.reset
net device-estopped wificnc.estopped => not.1.in
net device-fine not.1.out => iocontrol.0.emc-enable-in

net tool-change iocontrol.0.tool-change => iocontrol.0.tool-changed
net tool-prepare iocontrol.0.tool-prepare => iocontrol.0.tool-prepared
"""


def files(name: str, address: str, axes: Axes) -> dict[str, str]:
    """All files of a configuration. Raises ValueError when the axes are not X, Y ... without a gap."""
    joints = [_joint(joint, index, axis) for joint, (index, axis) in enumerate(axes.present())]
    if not joints or [index for index, _ in axes.present()] != list(range(len(joints))):
        raise ValueError("joint n is the controller's axis n: the machine needs axes from X on without a gap")
    fastest = max(float(joint["velocity"]) for joint in joints)
    letters = "".join(str(joint["letter"]) for joint in joints)
    values = {"name": name, "address": address, "letters": letters, "count": len(joints), "fastest": fastest}
    ini = INI.format(**values, slow=fastest / 4) + "".join(JOINT_INI.format(**joint) for joint in joints)
    outputs = range(OUTPUT_COUNT)
    digital = "\n".join(f"net dout-{n} motion.digital-out-{n:02} => wificnc.digital-out-{n:02}" for n in outputs)
    faults = " ".join(f"joint.{n}.amp-fault-in" for n in range(len(joints)))
    hal = HAL_HEAD.format(**values, outputs=OUTPUT_COUNT)
    hal += "".join(HAL_JOINT.format(**joint) for joint in joints) + HAL_TAIL.format(faults=faults, digital=digital)
    return {f"{name}.ini": ini, f"{name}.hal": hal, f"{name}.tbl": "T1 P1 D0 Z0 ;\n"}


def _joint(joint: int, index: int, axis: LinearAxis | RotaryAxis) -> dict[str, Value | str]:
    """Velocities in units/s, as LinuxCNC has them; what the profile leaves out is the controller's default."""
    values = {name: float(value) for name, value in axis.assigned()}
    defaults = load_settings()
    travel = values.get("max_travel_mm", float(defaults["max_travel_mm"].default))
    velocity = values["max_rate_mm_min"] / 60
    return {
        "joint": joint,
        "letter": AXES[index],
        "type": "LINEAR" if isinstance(axis, LinearAxis) else "ANGULAR",
        "low": -travel if travel else -ENDLESS,
        "high": 0.0 if travel else ENDLESS,
        "velocity": velocity,
        "acceleration": values["acceleration_mm_s2"],
        "scale": values["steps_per_mm"],
        "ferror": velocity * LAG_S + 1.0,
    }
