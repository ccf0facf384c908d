"""Periodic disturbance: an external force, periodic in time, as of a pump, a fan or an unbalanced spindle.

Law: F = A sin(2 pi f t + p).
Source: mismatch catalogue, entry periodic_disturbance, A sin(2 pi f t).
Symbols: F force on the table N; A `amplitude_n` N; f `frequency_hz` Hz; p `phase_rad` at power-up rad; t time
    since power-up s.
Valid: a source that the axis does not influence.
Confused with: cogging, periodic in position -> change the speed: only the frequency of cogging changes.
"""

import math
from typing import Annotated, Any, NamedTuple

from hil_sim.physics.kinds import Kind
from kernels.jit import kernel
from kernels.quantities import Quantity

KIND = Kind.FORCE_IN_TIME


class Params(NamedTuple):
    """One sinusoid."""

    amplitude_n: Annotated[float, Quantity("N", -1e4, 1e4, "amplitude A")]
    frequency_hz: Annotated[float, Quantity("Hz", 0.0, 2e3, "frequency f")]
    phase_rad: Annotated[float, Quantity("rad", -7.0, 7.0, "phase p at power-up", "deg")]


NEUTRAL = Params(amplitude_n=0.0, frequency_hz=1.0, phase_rad=0.0)


@kernel
def force_n(p: Any, time_s: float) -> float:
    """Return the force on the table (N) at a time since power-up (s)."""
    return float(p.amplitude_n * math.sin(2.0 * math.pi * p.frequency_hz * time_s + p.phase_rad))
