"""Screw error: difference between table and motor position, learned over the travel.

    x_motor = x* - e(x*),   e = scale - motor at the table position x, mean of both directions

ISO 230-2 calls 2 e's spread over the travel the mean bidirectional positional deviation; Wang et al. 2014 the
accumulated pitch error. Linear between the nodes, held beyond them.

When the compensation is switched on, or another table is put into use, e changes at the same position.
The backlash take-up absorbs that step by its motion, so that the motor does not jump.
"""

from dataclasses import dataclass
from typing import Annotated, NamedTuple

import numpy as np

from kernels.jit import kernel
from kernels.record_layout import Table
from servo_ctrl.control.offset_motion import OffsetMotion, shifted
from servo_ctrl.control.section import AxisFacts, Key, LawSection, Need
from servo_ctrl.control.table_lookup import place_of, value_at


@dataclass(frozen=True, kw_only=True)
class ScrewCompensationSettings:
    """Screw-error table and backlash take-up, learned from scale against encoder."""

    enabled: Annotated[bool, Key("Whether it acts from the start, once something has been learned.")] = True
    step_mm: Annotated[
        float | None,
        Key(
            "Largest distance of the table's nodes, millimetres; without it, a sixteenth of the lead.",
            above=0.0,
        ),
    ] = None
    travels: Annotated[
        int, Key("Number of travels there and back for learning.", at_least=2, at_most=100)
    ] = 3
    feed_mm_min: Annotated[float, Key("Speed of the travels, mm/min.", above=0.0)] = 1000.0
    dwell_s: Annotated[float, Key("Rest at the ends of a travel, seconds.", above=0.0, at_most=60.0)] = 0.5
    limit_um: Annotated[
        float, Key("A correction that would be larger is not learned, and not used, micrometres.", above=0.0)
    ] = 200.0


class Params(NamedTuple):
    """Learned table of the screw's errors."""

    enabled: bool
    table: Table
    """(2, n), n >= 1: rising table positions, m; error there, m."""


NEUTRAL = Params(enabled=False, table=np.zeros((2, 1)))


def params_of(_settings: ScrewCompensationSettings, _axis: AxisFacts) -> Params:
    """Parameters before anything is learned: off; `config.kernel_params.with_screw` sets the table."""
    return NEUTRAL


SECTION = LawSection(
    name="screw_compensation",
    meaning="Learned table of the screw's errors, and backlash take-up.",
    settings=ScrewCompensationSettings,
    params=params_of,
    neutral=NEUTRAL,
    needs=(Need.SCALE, Need.MOTOR_LED),
)


@kernel
def screw_error_m(p: Params, position_m: float) -> float:
    """Error e (m) at a table position (m); 0 when disabled."""
    if not p.enabled:
        return 0.0
    return value_at(p.table, 1, place_of(p.table, position_m))


@kernel
def without_table_step(
    p: Params, take_up: OffsetMotion, position_command_m: float, previous_error_m: float
) -> OffsetMotion:
    """The take-up, shifted by the step that a changed table makes at the last position command.

    `previous_error_m`: the error there by the table of the last tick. The motor does not jump.
    """
    return shifted(take_up, screw_error_m(p, position_command_m) - previous_error_m)
