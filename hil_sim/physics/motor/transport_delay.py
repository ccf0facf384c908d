"""Transport delay: the force acts later than the reported current.

Law: i'(t) = i(t - tau), tau rounded to whole substeps.
Source: mismatch catalogue, entry transport_delay, exp(-s tau): calculation, transmission, pulse-width
    modulation.
Symbols: i current that the amplifier asks for and reports A; i' current that makes force A; tau `delay_s` s.
Valid: up to 512 substeps, which the machine file's check holds.
Confused with: current_loop_lag -> a jump of the current shows the one as a delay, the other as a slope;
    half a sample of a recording's hold, which is no physics -> it does not change with the cycle of the
    controller.
"""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

from hil_sim.physics.jit import kernel
from hil_sim.physics.kinds import Kind
from hil_sim.physics.quantities import Quantity

KIND = Kind.CURRENT_PATH
LONGEST = 512
"""Substeps."""


class Params(NamedTuple):
    """The delay."""

    delay_s: Annotated[float, Quantity("s", 0.0, 0.05, "delay tau", "ms")]


NEUTRAL = Params(delay_s=0.0)


@kernel
def passed_a(p: Any, s: Any, current: float, _back_emf_v: float, dt_s: float) -> float:
    """Current (A) that makes force; `s.delayed_a` holds those under way, one a substep."""
    steps = int(p.delay_s / dt_s + 0.5)
    if steps == 0:
        return current
    slot = s.substeps % steps
    due = float(s.delayed_a[slot])
    s.delayed_a[slot] = current
    return due
