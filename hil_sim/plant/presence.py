"""Determines once a call which groups of less common effects an axis has: absent ones cost nothing."""

from typing import Any, NamedTuple

from hil_sim.physics.kinds import Kind
from hil_sim.physics.registry import of_kind
from kernels.jit import kernel
from kernels.unrolled import unrolled

CURRENT_PATH = of_kind(Kind.CURRENT_PATH, Kind.FORCE_RIPPLE)
FRICTION = of_kind(
    Kind.FRICTION_LEVEL,
    Kind.FRICTION_SPEED,
    Kind.FRICTION_LOAD,
    Kind.FRICTION_POSITION,
    Kind.FRICTION_DWELL,
    Kind.FRICTION_DIRECTION,
    Kind.DAMPING,
    Kind.PRESLIDING_LEVEL,
    Kind.FRICTION_CHANGE,
    Kind.CHANGE_IN_TIME,
    Kind.CHANGE_WITH_POSITION,
    common=False,
)
LOAD = of_kind(
    Kind.TABLE_FORCE,
    Kind.STATE_FORCE,
    Kind.FORCE_IN_TIME,
    Kind.MEMORY_FORCE,
    Kind.CHANGE_IN_TIME,
    Kind.CHANGE_WITH_POSITION,
    Kind.FORCE_OF_OTHER_AXIS,
    Kind.MASS,
    common=False,
)
SCREW_AND_USE = of_kind(Kind.POSITION_ERROR, Kind.FRICTION_CHANGE)
ENCODER = of_kind(Kind.ENCODER_READING)


class Presence(NamedTuple):
    """Whether any effect of each group is present; a group is a place where effects are composed."""

    current_path: bool
    friction: bool
    load: bool
    screw_or_use: bool
    encoder: bool


@kernel
@unrolled
def presence_of(p: Any) -> Presence:
    """Return the present groups of one AXIS_PARAMS."""
    current_path, friction, load, screw_or_use, encoder = 0, 0, 0, 0, 0
    for effect in CURRENT_PATH:
        current_path += p[effect].enabled
    for effect in FRICTION:
        friction += p[effect].enabled
    for effect in LOAD:
        load += p[effect].enabled
    for effect in SCREW_AND_USE:
        screw_or_use += p[effect].enabled
    for effect in ENCODER:
        encoder += p[effect].enabled
    return Presence(current_path > 0, friction > 0, load > 0, screw_or_use > 0, encoder > 0)
