"""The schema of `[axis.NAME.measured_plant]`, which `servo-ctrl tune` writes."""

from typing import Annotated, Self

from pydantic import Field, Strict, model_validator

from servo_ctrl.config.section import FileSection, NonNegative, Number, Positive

MODES_MAX = 3
"""Most modes of a plant: as many as `servo-ctrl tune` fits."""
PER_MODE = Field(min_length=0, max_length=MODES_MAX)
"""Of a list with one value for each mode."""


class MeasuredPlant(FileSection):
    """Measured response of the axis, with which margins are computed: mass, delay and resonances."""

    mass_kg: Positive
    """Moved mass, as the motor shows it, kg."""
    scale_mass_kg: Positive
    """The same, as the scale shows it, kg."""
    friction_1_s: NonNegative = 0.0
    """Viscous friction over the mass, 1/s."""
    delay_ms: Annotated[float, Strict(), Field(ge=-100.0, le=100.0)] = 0.0
    """From a force set point to the force, beyond one period, milliseconds."""
    mode_hz: Annotated[tuple[Positive, ...], PER_MODE] = ()
    """Natural frequencies of the modes, hertz."""
    mode_damping_ratio: Annotated[tuple[Positive, ...], PER_MODE] = ()
    """Their damping ratios."""
    mode_motor_1_kg: Annotated[tuple[Number, ...], PER_MODE] = ()
    """Their residues in the position of the motor, 1/kg, of either sign."""
    mode_scale_1_kg: Annotated[tuple[Number, ...], PER_MODE] = ()
    """Their residues in the position of the scale, likewise."""

    @model_validator(mode="after")
    def _one_value_for_each_mode(self) -> Self:
        for key in ("mode_damping_ratio", "mode_motor_1_kg", "mode_scale_1_kg"):
            count, modes = len(getattr(self, key)), len(self.mode_hz)
            if count != modes:
                raise ValueError(f"{key}: {count} values for {modes} modes in mode_hz")
        return self
