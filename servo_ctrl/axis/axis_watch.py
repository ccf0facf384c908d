"""Converts the findings of the compiled cycle on an axis to events, and monitors its limit switches."""

from typing import Any

from servo_ctrl.axis.fault_policy import Event
from servo_ctrl.config.model import AxisConfig
from servo_ctrl.control.signs import DISAGREE
from servo_ctrl.cyclic.axis_supervision import BAD_COMMAND, BEYOND, FOLLOWING_ERROR, RUNAWAY_BRAKED
from servo_ctrl.cyclic.drive_phases import problem_text
from servo_ctrl.cyclic.supervision import RUNAWAY, SATURATED

AxisEvent = tuple[Event, str]

EVENT_OF: dict[int, Event] = {
    BEYOND: Event.LIMIT,
    FOLLOWING_ERROR: Event.FOLLOWING_ERROR,
    BAD_COMMAND: Event.BAD_COMMAND,
    RUNAWAY: Event.RUNAWAY,
    DISAGREE: Event.SENSORS_DISAGREE,
    SATURATED: Event.SATURATED,
    RUNAWAY_BRAKED: Event.RUNAWAY,
}
"""The event of each bit of a `CycleRecord.found`, in the order in which they are reported."""


class AxisWatch:
    """Reports the events of the axis `name`."""

    def __init__(self, name: str, config: AxisConfig) -> None:
        self._name = name
        self._following_error_mm = config.limits.following_error_mm
        self._saturation_ms = config.limits.saturation_ms
        self._switches = 0

    def closed_switch(self, inputs: int, *, controlled: bool) -> str:
        """Take the digital inputs (60FDh); see `AxisServo.closed_switch`."""
        newly_closed, self._switches = inputs & ~self._switches & 0b11, inputs & 0b11
        if not (controlled and newly_closed):
            return ""
        return f"axis {self._name}: the {_side(newly_closed)} limit switch has closed"

    @property
    def at_a_switch(self) -> str:
        """The limit switch at which the axis stands, and what to do; "" if it stands at none."""
        if not self._switches:
            return ""
        where = f"axis {self._name} stands at its {_side(self._switches)} limit switch"
        return f"{where}: jog it away, slowly, and find out why its home position has shifted"

    def findings(self, axis: Any) -> list[AxisEvent]:
        """Return the events that the last cycle found, from the axis's `CycleRecord`."""
        bits, law = int(axis["found"]), axis["law"]
        sample, command = law["sample"], law["command"]
        inputs, mode = axis["inputs"], axis["sequence"]["mode"]
        drive = problem_text(axis["problem"], int(inputs["statusword"]), inputs["mode_shown"], mode)
        error_mm, limit_mm = command["position_error_m"] * 1e3, self._following_error_mm
        deviation_m = sample["motor_position_m"] - command["correction_m"] - sample["scale_position_m"]
        runaway_text = f"runs away from its set point, against {sample['motor_force_n']:.0f} N"
        deviation_text = (
            f"{deviation_m * 1e3:.3f} mm apart, more than {law['limits']['deviation_m'] * 1e3:g} mm"
        )
        saturation_text = f"force saturated for {self._saturation_ms:g} ms"
        texts = {
            BEYOND: f"at {axis['violation_m'] * 1e3:.3f} mm, beyond limits.position_mm",
            FOLLOWING_ERROR: f"following error of {error_mm:.3f} mm exceeds {limit_mm:g} mm",
            BAD_COMMAND: "the set point is not a number",
            RUNAWAY: f"{runaway_text}; check the signs of feedback and current",
            DISAGREE: f"encoder and scale are {deviation_text}; check scale and coupling",
            SATURATED: f"{saturation_text}; check for an obstruction",
            RUNAWAY_BRAKED: "accelerates while its drive brakes; check the sign of the feedback",
        }
        events = [(event, texts[bit]) for bit, event in EVENT_OF.items() if bits & bit]
        if drive:
            events.insert(0, (Event.DRIVE_FAULT, f"the drive {drive}"))
        return [(event, f"axis {self._name}: {text}") for event, text in events]


def _side(switches: int) -> str:
    return "negative" if switches & 1 else "positive"
