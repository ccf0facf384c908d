"""Transport delay: the force acts later than the reported current.

Law: i'(t) = i(t - tau), tau rounded to whole substeps.
Source: mismatch catalogue, entry transport_delay, exp(-s tau): calculation, transmission, pulse-width
    modulation.
Symbols: i commanded current, which the amplifier reports, A; i' force-producing current A; tau `delay_s` s.
Valid: up to 512 substeps, which the check of the plant file enforces.
Confused with: current_loop_lag -> apply a step of the current: a delay shifts it, a lag gives a slope; the
    half-sample delay of a zero-order hold, which is not physics -> a physical delay does not change with the
    controller's cycle.
"""

from collections.abc import Iterator
from typing import Annotated, Any, NamedTuple

from hil_sim.physics.kinds import AxisContext, Kind
from kernels.jit import kernel
from kernels.quantities import Quantity

KIND = Kind.CURRENT_PATH
ORDER = 4  # between drive and motor
DELAY_MAX = 512
"""Bounds the delay, in substeps: the length of the state's buffer; 25.6 ms at 50 us, chosen."""


class Params(NamedTuple):
    """The delay."""

    delay_s: Annotated[float, Quantity("s", 0.0, 0.05, "delay tau", "ms")]


class State(NamedTuple):
    """The delayed currents (A), one a substep, and the index of the oldest."""

    delayed_a: tuple[float, ...] = (0.0,) * DELAY_MAX
    oldest: int = 0


NEUTRAL = Params(delay_s=0.0)


def problems(p: Params, axis: AxisContext) -> Iterator[tuple[str, str]]:
    """Yield a problem if the delay exceeds the state's length."""
    if p.delay_s > DELAY_MAX * axis.dt_s:
        yield "delay_ms", f"more than {DELAY_MAX} substeps"


@kernel
def force_producing_a(p: Any, s: Any, current: float, _back_emf_v: float, dt_s: float) -> float:
    """Return the force-producing current (A)."""
    steps = int(p.delay_s / dt_s + 0.5)
    if steps == 0:
        return current
    delayed_a = float(s.delayed_a[s.oldest])
    s.delayed_a[s.oldest] = current
    s.oldest = (s.oldest + 1) % steps
    return delayed_a
