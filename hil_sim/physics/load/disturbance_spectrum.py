"""Disturbance of a given spectrum: a force in time of which only the spectrum is known.

Law: F = sum_k A_k sin(2 pi f_k t + p_k), the phases p_k uniform over 0 to 2 pi, drawn from a seed.
Source: spectral representation of a random process, Shinozuka and Deodatis (1991): lines of amplitude
    sqrt(2 S df) with random phases have the spectrum S.
Symbols: F force on the table N; A_k `amplitude_n` N; f_k `frequency_hz` Hz; t time since power-up s; p_k
    from the seed `seed`.
Valid: stationary; it repeats after the inverse of the lines' common spacing. It has the spectrum of the
    recorded disturbance, but not its time course.
Confused with: periodic_disturbance -> one line with a known phase.
"""

import math
from typing import Annotated, Any, NamedTuple

from hil_sim.physics.kinds import Kind
from kernels.jit import kernel
from kernels.quantities import Quantity

KIND = Kind.FORCE_IN_TIME
LINES_MAX = 16
"""Bounds the number of lines, which is the length of the record; chosen."""
LIST_ENDS_AT = "amplitude_n"
WEYL_STEP = 0.6180339887498949
"""Golden ratio - 1: its multiples modulo 1 are uniform (Weyl); seed and line give the multiple."""


class Params(NamedTuple):
    """Up to sixteen lines; the list ends at the first amplitude of zero."""

    frequency_hz: Annotated[tuple[float, ...], Quantity("Hz", 0.0, 2e3, "frequency f_k", length=LINES_MAX)]
    amplitude_n: Annotated[tuple[float, ...], Quantity("N", 0.0, 1e4, "amplitude A_k", length=LINES_MAX)]
    seed: Annotated[float, Quantity("", 0.0, 1e6, "seed of the phases")] = 0.0


NEUTRAL = Params(frequency_hz=(1.0,) * LINES_MAX, amplitude_n=(0.0,) * LINES_MAX)


@kernel
def phase_rad(seed: float, line: int) -> float:
    """Return the phase p_k of line `line` (rad), 0 to 2 pi."""
    turns = WEYL_STEP * (1.0 + line) * (1.0 + line) * (7.0 + seed) + WEYL_STEP * line
    return 2.0 * math.pi * (turns - math.floor(turns))


@kernel
def force_n(p: Any, time_s: float) -> float:
    """Return the force on the table (N) at a time since power-up (s)."""
    force = 0.0
    for k in range(LINES_MAX):
        if p.amplitude_n[k] == 0.0:
            break
        force += p.amplitude_n[k] * math.sin(
            2.0 * math.pi * p.frequency_hz[k] * time_s + phase_rad(p.seed, k)
        )
    return force
