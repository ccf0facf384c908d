"""One axis of the nominal model: its mechanics, its sensors, and its model effects."""

from pathlib import Path
from typing import Any, NamedTuple


class BusNodes(NamedTuple):
    """Nodes of an axis on the CAN bus, and the rated values to which per mille refer."""

    drive_node_id: int
    drive_eds: Path
    rated_torque_nm: float
    rated_current_a: float
    scale_node_id: int | None = None
    scale_eds: Path | None = None


class ModelEffects(NamedTuple):
    """The effects that the model gives one axis."""

    effects: dict[str, Any]
    """`Params` of hil_sim by effect, without neutral ones."""
    followed: dict[str, str]
    """The other axis by each effect that follows one."""


class DriveLoops(NamedTuple):
    """What the loops of the drive do to its set points; zeros where the model has no gains."""

    feedforward_n_s_m: float = 0.0
    """Force per velocity of the set points: velocity gain times velocity feedforward."""
    current_lag_s: float = 0.0
    """Time constant of the current loop."""


class NominalAxis(NamedTuple):
    """The values of one axis in the model, SI; None where the model has no value."""

    lead_m: float
    """Travel per turn of the screw."""
    force_constant_n_a: float
    """Motor force at the table per current."""
    mass_kg: float
    """The whole moved mass, rotor and screw included."""
    motor_mass_kg: float
    """Rotating inertia as a mass at the table; 0 = not known."""
    viscous_n_s_m: float
    coulomb_n: float
    """Sharp Coulomb friction, without that of presliding."""
    encoder_resolution_m: float | None
    """One count of the motor encoder, at the table."""
    scale_resolution_m: float | None
    """One count of the linear scale."""
    pole_pairs: int | None
    """Pole pairs of the motor."""
    grating_m: float | None
    """Period of the scale's grating."""
    bus: BusNodes | None
    """Nodes for logs of the CAN bus."""
    model_effects: ModelEffects = ModelEffects({}, {})
    """The model effects."""
    drive_loops: DriveLoops = DriveLoops()
    """The loops of the drive, for recordings of its position mode."""
    rotary: bool = False
    """1 m stands for 1 rad, 1 N for 1 N m, 1 kg for 1 kg m^2."""


def baseline_parameters(axis: NominalAxis) -> dict[str, float]:
    """Return mass and friction of everything that moves, as the baseline of a regression has them."""
    effects, mass_kg, coulomb_n = axis.model_effects.effects, axis.mass_kg, axis.coulomb_n
    for carrying in ("payload_mass", "structural_mode"):
        mass_kg += effects[carrying].mass_kg if carrying in effects else 0.0
    for presliding in ("presliding_hysteresis", "presliding_elements"):  # beside the sharp friction
        coulomb_n += effects[presliding].level_n if presliding in effects else 0.0
    return {"mass_kg": mass_kg, "viscous_n_s_m": axis.viscous_n_s_m, "coulomb_n": coulomb_n}
