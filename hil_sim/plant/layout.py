"""The records of the plant: parameters, state and set point of an axis, as C-aligned numpy structures.

Every effect has its own nested record (`params[a].cogging.amplitude_n[k]` in a kernel), made from its
`Params`; `enabled` is 0 for an absent effect.
"""

import math
from types import ModuleType
from typing import Annotated, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hil_sim.physics.kinds import OtherAxis
from hil_sim.physics.registry import EFFECTS, with_state
from hil_sim.plant import amplifier
from hil_sim.plant.measured_point import measured_point_m
from hil_sim.plant.other_axes import FORCES_OF_OTHER_AXIS
from hil_sim.plant.readings import encoder_counts, scale_counts
from hil_sim.plant.step import screw_error
from kernels.quantities import Quantity, record_dtype, section_of


class Mechanics(NamedTuple):
    """Parameters of every axis: masses, screw, force constant, and position at power-up."""

    lead_m: Annotated[float, Quantity("m", 1e-5, 10.0, "travel per turn of the screw", "mm")]
    motor_mass_kg: Annotated[float, Quantity("kg", 0.0, 1e6, "rotating inertia as a mass, J (2 pi / lead)^2")]
    table_mass_kg: Annotated[float, Quantity("kg", 1e-7, 1e6, "moving mass")]
    force_constant_n_a: Annotated[
        float, Quantity("N/A", 1e-6, 1e9, "motor force per current, Kt 2 pi / lead")
    ]
    start_m: Annotated[float, Quantity("m", -10.0, 10.0, "position at power-up", "mm")]


def state_dtype(state: type[Any]) -> np.dtype[Any]:
    """Return the C-aligned record of a `State` class; defaults give the types, numbers or lists."""
    defaults = {name: np.asarray(value) for name, value in state._field_defaults.items()}
    return np.dtype([(name, value.dtype, value.shape) for name, value in defaults.items()], align=True)


AXIS_PARAMS = np.dtype(
    [
        ("mechanics", record_dtype(Mechanics)),
        ("amplifier", record_dtype(amplifier.Params)),
        *((section_of(module), record_dtype(module.Params)) for module in EFFECTS),
    ],
    align=True,
)

AXIS_STATE = np.dtype(
    [
        ("time_s", np.float64),
        ("substeps", np.int64),  # since power-up; time_s is substeps * dt_s, so it does not drift
        ("loop", np.int64),  # the loop of the last substep, see amplifier
        ("position_setpoint_m", np.float64),  # set points of the previous call, for the interpolation
        ("velocity_setpoint_m_s", np.float64),
        ("current_a", np.float64),
        ("current_measured_a", np.float64),
        ("current_integral_v", np.float64),
        ("voltage_v", np.float64),
        ("velocity_integral_n", np.float64),
        ("motor_position_m", np.float64),  # angle times lead / 2 pi, from the machine's zero
        ("motor_velocity_m_s", np.float64),
        ("table_position_m", np.float64),
        ("table_velocity_m_s", np.float64),
        ("carried_position_m", np.float64),  # mass of structural_mode; unused without it
        ("carried_velocity_m_s", np.float64),
        ("encoder_counts", np.int64),  # from the power-up origin
        ("encoder_origin_counts", np.int64),
        ("encoder_velocity_m_s", np.float64),
        ("scale_counts", np.int64),  # from the power-up origin
        ("scale_origin_counts", np.int64),
        ("friction_n", np.float64),  # on the table, of the last substep
        ("transmitted_n", np.float64),  # screw to table, of the last substep
        *((section_of(module), state_dtype(module.State)) for module in with_state(tuple(EFFECTS))),
    ],
    align=True,
)

SETPOINT = np.dtype(
    [
        ("loop", np.int64),  # 0 off, 1 current, 2 velocity, 3 position
        ("current_a", np.float64),
        ("velocity_m_s", np.float64),
        ("position_m", np.float64),  # from the encoder's power-up origin
        ("velocity_offset_m_s", np.float64),
        ("current_offset_a", np.float64),
        ("current_limit_a", np.float64),
        ("limit_reduction_positive_a", np.float64),  # of the limit of this sign
        ("limit_reduction_negative_a", np.float64),
    ],
    align=True,
)


def write_state(record: Any, values: Any) -> None:
    """Write a `State` tuple into its nested record (a view, in place)."""
    for name, value in values._asdict().items():
        record[name] = value


def state_record(effect: ModuleType) -> Any:
    """Return a separate record with the state of one effect at power-up."""
    record = np.zeros(1, state_dtype(effect.State))[0]
    write_state(record, effect.State())
    return record


def write_params(record: Any, values: Any) -> None:
    """Write a `Params` tuple into its nested record (a view, in place) and enable it."""
    record["enabled"] = 1
    for name, value in values._asdict().items():
        record[name] = value


def power_up(params: NDArray[Any]) -> NDArray[Any]:
    """Return the state (axes,) of a plant after a long dwell at its start position, with zero currents."""
    state = np.zeros(len(params), AXIS_STATE)
    for p, s in zip(params, state, strict=True):
        for effect in with_state(tuple(EFFECTS)):
            own = p[section_of(effect)]
            by_parameters = own["enabled"] and hasattr(effect, "powered_up")
            write_state(s[section_of(effect)], effect.powered_up(own) if by_parameters else effect.State())
        start_m = p["mechanics"]["start_m"]
        s["motor_position_m"] = start_m
        error_m, _ = screw_error(p, s, start_m, 2.0 * math.pi / p["mechanics"]["lead_m"])
        s["table_position_m"] = s["carried_position_m"] = start_m + error_m
    for p, s in zip(params, state, strict=True):
        if p["cross_axis_coupling"]["enabled"]:
            other = int(p["cross_axis_coupling"]["other"])
            s["cross_axis_coupling"]["other_position_m"] = measured_point_m(params[other], state[other])
        for effect in FORCES_OF_OTHER_AXIS:
            own = p[section_of(effect)]
            if own["enabled"]:
                other_m = state[int(own["other"])]["table_position_m"]
                write_state(s[section_of(effect)], OtherAxis(position_m=float(other_m)))
        if p["encoder"]["enabled"]:
            s["encoder_origin_counts"] = encoder_counts(p, s)
        if p["scale"]["enabled"]:
            s["scale_origin_counts"] = scale_counts(p, s)
    return state
