"""Transport delay: the force acts later than the reported current.

Law: i'(t) = i(t - tau), tau rounded to whole substeps.
Source: mismatch catalogue, entry transport_delay, exp(-s tau): calculation, transmission, pulse-width
    modulation.
Symbols: i commanded current, which the amplifier reports, A; i' current that makes force A; tau `delay_s` s.
Valid: up to 512 substeps, which the machine file's check holds.
Confused with: current_loop_lag -> a jump of the current shows the one as a delay, the other as a slope;
    half a sample of a recording's hold, which is no physics -> it does not change with the cycle of the
    controller.
"""

from collections.abc import Iterator
from typing import Annotated, Any, NamedTuple

from hil_sim.physics.kinds import AxisContext, Kind
from kernels.jit import kernel
from kernels.quantities import Quantity

KIND = Kind.CURRENT_PATH
ORDER = 4  # between drive and motor
LONGEST = 512
"""Substeps."""


class Params(NamedTuple):
    """The delay."""

    delay_s: Annotated[float, Quantity("s", 0.0, 0.05, "delay tau", "ms")]


class State(NamedTuple):
    """The currents under way, one a substep, and the index of the oldest."""

    delayed_a: tuple[float, ...] = (0.0,) * LONGEST
    oldest: int = 0


NEUTRAL = Params(delay_s=0.0)


def problems(p: Params, axis: AxisContext) -> Iterator[tuple[str, str]]:
    """The currents under way fit into the state."""
    if p.delay_s > LONGEST * axis.dt_s:
        yield "delay_ms", f"more than {LONGEST} substeps"


@kernel
def passed_a(p: Any, s: Any, current: float, _back_emf_v: float, dt_s: float) -> float:
    """Current (A) that makes force."""
    steps = int(p.delay_s / dt_s + 0.5)
    if steps == 0:
        return current
    due = float(s.delayed_a[s.oldest])
    s.delayed_a[s.oldest] = current
    s.oldest = (s.oldest + 1) % steps
    return due
