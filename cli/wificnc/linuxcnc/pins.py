"""The component's pins: what LinuxCNC wants, and what it is told."""

from __future__ import annotations

from typing import Any

from wificnc.wmc3.layout import IoControl

OUTPUT_COUNT, INPUT_COUNT = 5, 4
LOOKS_MOST = 200  # at the servo thread's pins, until it has not run between two looks
PROBING = 5  # motion.motion-type of G38


class Pins:
    """hal: LinuxCNC's module, or what does as it. Names are those of docs/linuxcnc.md."""

    def __init__(self, hal: Any, name: str, joints: int) -> None:
        self.component = hal.component(name)
        self.joints = range(joints)
        add = self.component.newpin
        for joint in self.joints:
            self._add_joint(hal, f"joint.{joint}")
        for pin in ("enable", "estop", "reset", "spindle-on", "spindle-reverse", "flood", "mist"):
            add(pin, hal.HAL_BIT, hal.HAL_IN)
        for pin in ("connected", "ready", "fault", "estopped", "estop-ok", "probe", "homing", "spindle-at-speed"):
            add(pin, hal.HAL_BIT, hal.HAL_OUT)
        for number in range(OUTPUT_COUNT):
            add(f"digital-out-{number:02}", hal.HAL_BIT, hal.HAL_IN)
        for number in range(INPUT_COUNT):
            add(f"digital-in-{number:02}", hal.HAL_BIT, hal.HAL_OUT)
            add(f"digital-in-{number:02}-not", hal.HAL_BIT, hal.HAL_OUT)
        add("motion-type", hal.HAL_S32, hal.HAL_IN)
        add("servo-time", hal.HAL_FLOAT, hal.HAL_IN)
        add("spindle-rpm", hal.HAL_FLOAT, hal.HAL_IN)
        add("spindle-index-enable", hal.HAL_BIT, hal.HAL_IO)
        for pin in ("queue-ms", "spindle-revs", "spindle-speed-rps"):
            add(pin, hal.HAL_FLOAT, hal.HAL_OUT)
        for pin in ("underruns", "datagrams"):
            add(pin, hal.HAL_U32, hal.HAL_OUT)

    def _add_joint(self, hal: Any, prefix: str) -> None:
        add = self.component.newpin
        add(f"{prefix}.position-cmd", hal.HAL_FLOAT, hal.HAL_IN)
        add(f"{prefix}.position-fb", hal.HAL_FLOAT, hal.HAL_OUT)
        add(f"{prefix}.scale", hal.HAL_FLOAT, hal.HAL_IN)
        add(f"{prefix}.index-enable", hal.HAL_BIT, hal.HAL_IO)
        for pin in ("limit", "home-switch"):
            add(f"{prefix}.{pin}", hal.HAL_BIT, hal.HAL_OUT)
        self.component[f"{prefix}.scale"] = 1.0

    def __getitem__(self, name: str) -> Any:
        return self.component[name]

    def __setitem__(self, name: str, value: Any) -> None:
        self.component[name] = value

    def ready(self) -> None:
        self.component.ready()

    @property
    def scales(self) -> list[float]:
        """Steps per unit; never 0."""
        return [self[f"joint.{joint}.scale"] or 1.0 for joint in self.joints]

    @property
    def is_probing(self) -> bool:
        """LinuxCNC executes G38."""
        return bool(self["motion-type"] == PROBING)

    @property
    def index_enables(self) -> int:
        """Mask of the joints that LinuxCNC wants to be homed."""
        return sum(bool(self[f"joint.{joint}.index-enable"]) << joint for joint in self.joints)

    def sample(self) -> tuple[float, list[float]]:
        """Servo time and commanded positions of one servo period. The servo thread may run meanwhile: look again."""
        for _ in range(LOOKS_MOST):
            before = self["servo-time"]
            positions = [self[f"joint.{joint}.position-cmd"] for joint in self.joints]
            if self["servo-time"] == before:
                break
        return before, positions

    def positions(self, steps: tuple[int, ...]) -> list[float]:
        """Of all joints, units."""
        return [steps[joint] / scale for joint, scale in zip(self.joints, self.scales, strict=True)]

    def show_positions(self, steps: tuple[int, ...]) -> None:
        """position-fb of all joints."""
        for joint, position in zip(self.joints, self.positions(steps), strict=True):
            self[f"joint.{joint}.position-fb"] = position

    def outputs(self) -> IoControl:
        """What LinuxCNC wants of spindle, coolant and outputs."""
        rpm = min(abs(self["spindle-rpm"]), 65535)
        return IoControl(
            misc_outputs=sum(bool(self[f"digital-out-{n:02}"]) << n for n in range(OUTPUT_COUNT)),
            spindle=(2 if self["spindle-reverse"] else 1) if self["spindle-on"] else 0,
            rpm=round(rpm) if rpm == rpm else 0,
            coolant=bool(self["flood"]) | bool(self["mist"]) << 1,
        )
