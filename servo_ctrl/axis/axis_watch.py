"""Supervises one axis: keeps the counts of `supervision` and turns findings into events."""

import math
from collections.abc import Callable, Sequence

from servo_ctrl.axis.fault_policy import Event
from servo_ctrl.axis.supervision import (
    AT_REST,
    BRAKE_BEGINS,
    RUNAWAY,
    SATURATED,
    supervise,
    supervise_braking,
    supervision_limits,
)
from servo_ctrl.canopen.scaling import DriveScaling
from servo_ctrl.config.model import AxisConfig
from servo_ctrl.control.signs import DISAGREE
from servo_ctrl.control.types import AxisCommand, Status

Found = tuple[Event, str]

LET_BACK = 0.5
"""Of the following error limit: how far an axis led back from beyond its limits may overshoot; chosen."""
_FOLLOWING_ERROR = int(Status.FOLLOWING_ERROR)
_BAD_COMMAND = int(Status.BAD_COMMAND)


class AxisWatch:
    """Supervises the axis called `name`."""

    def __init__(self, name: str, config: AxisConfig, unit: DriveScaling, period_s: float) -> None:
        self.limits = supervision_limits(config, unit, period_s)
        self._name, self._period_s = name, period_s
        self._newton_per_ampere = unit.newton_per_ampere
        self._following_error_mm = config.limits.following_error_mm
        self._saturation_ms = config.limits.saturation_ms
        self._switches = 0
        lowest_mm, highest_mm = config.limits.position_mm
        self.lowest_m = (lowest_mm - self._following_error_mm) * 1e-3
        self.highest_m = (highest_mm + self._following_error_mm) * 1e-3
        self._swing_m = LET_BACK * self._following_error_mm * 1e-3
        self.begin()

    def begin(self, at_m: float = 0.0) -> None:
        """Begin anew, as the axis is taken over here, or given up."""
        self._counts, self._braking = AT_REST, BRAKE_BEGINS
        self._before_m = math.nan
        out_m = self._out_m(at_m)
        self._led_back_m = out_m + self._swing_m if out_m > 0.0 else 0.0

    def beyond(self, at_m: float) -> Sequence[Found]:
        """Judge a position beyond `lowest_m` to `highest_m`; an axis taken over there may be led back."""
        out_m = self._out_m(at_m)
        if out_m > self._led_back_m:
            return [(Event.LIMIT, f"axis {self._name}: at {at_m * 1e3:.3f} mm, beyond limits.position_mm")]
        self._led_back_m = min(self._led_back_m, out_m + self._swing_m)
        return ()

    def _out_m(self, at_m: float) -> float:
        return max(self.lowest_m - at_m, at_m - self.highest_m)

    def closed_switch(self, inputs: int, *, led: bool) -> str:
        """Take the digital inputs (60FDh); see `AxisServo.closed_switch`."""
        closed, self._switches = inputs & ~self._switches & 0b11, inputs & 0b11
        if not (led and closed):
            return ""
        return f"axis {self._name}: the {_side(closed)} limit switch has closed"

    @property
    def at_a_switch(self) -> str:
        """At which limit switch the axis stands, and what to do about it; "" where it stands at none."""
        if not self._switches:
            return ""
        where = f"axis {self._name} stands at its {_side(self._switches)} limit switch"
        return f"{where}: jog it away, slowly, and find out why home is not where it was"

    def led(
        self,
        command: AxisCommand,
        seen: int,
        motor_m: float,
        scale_m: float,
        current_a: float,
        input_age: Callable[[], int],
    ) -> Sequence[Found]:
        """Judge one cycle of an axis that we lead and that shows something; see `led_well`.

        `seen`: its signs (`control.signs`); `input_age()`: cycles that its inputs may be old.
        """
        if command.status:
            return self._bad_status(command)
        force_n = command.force_n
        measured_n = current_a * self._newton_per_ampere
        deviation_m = motor_m - command.correction_m - scale_m
        self._counts, finding = supervise(
            self.limits,
            self._counts,
            seen,
            force_n if math.isnan(measured_n) else measured_n,
            command.motor_velocity_m_s,
            command.position_error_m,
        )
        if finding & DISAGREE:  # of different cycles they differ by the travel between them
            travel_m = abs(command.motor_velocity_m_s) * self._period_s * input_age()
            if abs(deviation_m) <= self.limits.deviation_m + travel_m:
                finding &= ~DISAGREE
        return self._finding_events(finding, deviation_m, measured_n) if finding else ()

    def led_well(self) -> None:
        """Note one cycle of an axis that we lead, whose status and signs are 0: nearly every one."""
        self._counts = AT_REST

    def braked(self, motor_m: float) -> Sequence[Found]:
        """Judge one cycle of an axis that its drive brakes; a position that did not come is left out."""
        velocity_m_s, self._before_m = (motor_m - self._before_m) / self._period_s, motor_m
        if math.isnan(velocity_m_s):
            return ()
        self._braking, runs_away = supervise_braking(self.limits, self._braking, velocity_m_s)
        if not runs_away:
            return ()
        text = f"axis {self._name}: gets faster while its drive brakes; check the feedback's sign"
        return [(Event.RUNAWAY, text)]

    def _bad_status(self, command: AxisCommand) -> Sequence[Found]:
        error_mm, limit_mm = command.position_error_m * 1e3, self._following_error_mm
        following = f"following error of {error_mm:.3f} mm exceeds {limit_mm:g} mm"
        return self._events(
            command.status,
            (_FOLLOWING_ERROR, Event.FOLLOWING_ERROR, following),
            (_BAD_COMMAND, Event.BAD_COMMAND, "the set point is not a number"),
        )

    def _finding_events(self, finding: int, deviation_m: float, measured_n: float) -> Sequence[Found]:
        limit_mm, time = self.limits.deviation_m * 1e3, f"{self._saturation_ms:g} ms"
        away = f"runs away from its set point, against {measured_n:.0f} N"
        apart = f"encoder and scale are {deviation_m * 1e3:.3f} mm apart, more than {limit_mm:g} mm"
        at_limit = f"force at its limit for {time} without a break; is something in its way?"
        return self._events(
            finding,
            (RUNAWAY, Event.RUNAWAY, f"{away}; check the signs of feedback and current"),
            (DISAGREE, Event.SENSORS_DISAGREE, f"{apart}; check scale and coupling"),
            (SATURATED, Event.SATURATED, at_limit),
        )

    def _events(self, bits: int, *events: tuple[int, Event, str]) -> Sequence[Found]:
        """Return the events whose bit is set, with the name of the axis."""
        return [(event, f"axis {self._name}: {text}") for bit, event, text in events if bits & bit]


def _side(switches: int) -> str:
    return "negative" if switches & 1 else "positive"
