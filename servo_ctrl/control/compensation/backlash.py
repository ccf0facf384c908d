"""Backlash take-up: the motor is led by half the lost motion in the direction of motion, ahead of the table.

    x_motor = x* + d b / 2,   d the direction of the last motion of the command, b the lost motion

After a reversal the motor takes up b with a five-phase S curve of its own. A reversal during a take-up waits
for its end, so that the velocity of the set point never jumps.
Source: ISO 230-2, reversal value B; Wang et al. 2014, section 1.
"""

import math
from dataclasses import dataclass
from typing import Annotated, NamedTuple

from kernels.jit import kernel
from kernels.quantities import Quantity
from servo_ctrl.control.offset_motion import OffsetMotion, advanced, over, rest_to_rest
from servo_ctrl.control.section import AxisFacts, Key, LawSection
from servo_ctrl.units import MM


@dataclass(frozen=True, kw_only=True)
class TakeUpSettings:
    """Keys of the screw compensation that say how fast the lost motion is taken up."""

    take_up_acceleration_mm_s2: Annotated[
        float, Key("Acceleration with which the lost motion is taken up after a reversal, mm/s^2.", above=0.0)
    ] = 500.0
    take_up_jerk_mm_s3: Annotated[float, Key("Likewise its jerk, mm/s^3.", above=0.0)] = 50_000.0


class Params(NamedTuple):
    """Lost motion, and how fast the motor takes it up. The state is an `OffsetMotion`."""

    enabled: bool
    lost_motion_m: Annotated[float, Quantity("m", -math.inf, math.inf, "b")]
    acceleration_m_s2: Annotated[float, Quantity("m/s2", 0.0, math.inf, "of the take-up, > 0")]
    jerk_m_s3: Annotated[float, Quantity("m/s3", 0.0, math.inf, "of the take-up, > 0")]


NEUTRAL = Params(enabled=False, lost_motion_m=0.0, acceleration_m_s2=1.0, jerk_m_s3=1.0)


def params_of(settings: TakeUpSettings, _axis: AxisFacts) -> Params:
    """Parameters before anything is learned: off; `config.kernel_params.with_screw` sets the lost motion."""
    return NEUTRAL._replace(
        acceleration_m_s2=float(settings.take_up_acceleration_mm_s2) * MM,
        jerk_m_s3=float(settings.take_up_jerk_mm_s3) * MM,
    )


SECTION = LawSection(
    name="screw_compensation",
    meaning="Learned table of the screw's errors, and backlash take-up.",
    settings=TakeUpSettings,
    params=params_of,
    neutral=NEUTRAL,
)


@kernel
def advance_take_up(p: Params, state: OffsetMotion, direction: float, period_s: float) -> OffsetMotion:
    """The take-up one period later. `direction`: of the last motion, +1 or -1; 0 before the first."""
    wanted_m = 0.5 * p.lost_motion_m * direction if p.enabled else 0.0
    if over(state) and wanted_m != state.to_m:
        state = rest_to_rest(state.to_m, wanted_m, True, p.acceleration_m_s2, p.jerk_m_s3)
    return advanced(state, period_s)
