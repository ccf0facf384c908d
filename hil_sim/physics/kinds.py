"""The kinds of effects: one signature each, so that a new effect fits where its siblings stand.

An effect's module has `KIND`, `Params`, `NEUTRAL` (the values that change nothing, or None where no values
can) and the functions of its kind. `p` is a `Params` tuple in a test and a record in the plant.
"""

from __future__ import annotations

from enum import Enum


class Kind(Enum):
    """Kind of an effect; the value lists the functions its module must have, with their arguments.

    `turn_rad_m` is the screw's angle per travel, 2 pi / lead; `s` the axis' state record, changed in place.
    """

    WINDING = (("current_a", "p current voltage_v back_emf_v dt_s"),)
    CURRENT_PATH = (("passed_a", "p s current back_emf_v dt_s"),)
    FORCE = (("force_n", "p position_m turn_rad_m"),)
    FORCE_IN_TIME = (("force_n", "p time_s"),)
    FORCE_SHARE = (("share", "p position_m turn_rad_m"),)
    MASS = (("added_kg", "p"),)
    FRICTION_LEVEL = (("level_n", "p speed_m_s"),)
    FRICTION_PLACE = (("level_n", "p position_m"),)
    FRICTION_REST = (("level_n", "p s"), ("slide", "p s velocity_m_s dt_s"))
    FRICTION_SIDE = (("level_n", "p direction"),)
    DAMPING = (("damping_n_s_m", "p velocity_m_s"),)
    FRICTION_CHANGE = (("factors", "p time_s travelled_m warmth_k"),)
    PRESLIDING = (("force_and_damping", "p s velocity_m_s level"), ("slide", "p s velocity_m_s level dt_s"))
    POSITION_ERROR = (
        ("error_m", "p position_m turn_rad_m temperature_k"),
        ("slope", "p position_m turn_rad_m temperature_k"),
    )
    COUPLING = (("force_n", "p deflection_m rate_m_s"),)
    PLAY = (("deflection_m", "p gap_m"),)
    SENSOR = (("counts", "p position_m"),)
    READING = (("error_m", "p position_m turn_rad_m"),)
    CROSS_READING = (("error_m", "p other_m"),)
