"""controller.toml as types: the fuzzy-PD position law."""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import Field, Strict, model_validator

from servo_ctrl.config.section import NonNegative, Positive, Section


class FuzzyPdConfig(Section):
    """Fuzzy-PD in place of the position loop's PID law (Xia et al.); kp_1_s and kd are its PD part."""

    enabled: bool = True
    """Whether it acts; else the PID law does."""
    fine_um: Positive
    """e1: up to this error the fuzzy controller is alone, with its integral, micrometres."""
    coarse_um: Positive
    """e2: from this error on the PD law is alone, micrometres."""
    weight_1_mm: Annotated[float, Strict(), Field(ge=1e-6)] = 1.0
    """k_e of the exponential weighting between e1 and e2, 1/mm; small = linear."""
    error_gain_1_mm: Positive
    """Ke: an error of 1 / Ke is positive big, 1/mm."""
    change_gain_s_mm: NonNegative
    """Kec: a change of the error of 1 / Kec is positive big, s/mm."""
    output_mm_s: Positive
    """Ku: velocity set point of the largest output, mm/s."""
    ki_1_s2: NonNegative = 0.0
    """k_i: integral gain within e1, 1/s^2."""

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.fine_um >= self.coarse_um:
            raise ValueError(f"coarse_um: must be above fine_um {self.fine_um:g}")
        return self
