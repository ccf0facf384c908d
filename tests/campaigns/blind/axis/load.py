"""Forces on the table: of a place, of time, of another axis, of a relaxing part and of an absorber."""

import math
from typing import NamedTuple

from tests.campaigns.blind.compiled import compiled
from tests.campaigns.blind.nonlinearities import wave
from tests.campaigns.blind.plant import Plant


class LoadState(NamedTuple):
    """Relaxing force, and the absorber's motion."""

    relaxation_n: float
    absorber_m: float
    absorber_m_s: float


class Load(NamedTuple):
    """The load and its parts, newtons."""

    load_n: float
    position_n: float
    disturbance_n: float
    foreign_n: float
    coupling_n: float
    absorber_n: float


@compiled
def load(
    p: Plant,
    state: LoadState,
    table_m: float,
    table_m_s: float,
    coupled_m_s2: float,
    noise_n: float,
    now_s: float,
    h: float,
) -> tuple[Load, LoadState]:
    """Return the load after a step of `h` seconds; `coupled_m_s2` is the acceleration of the other axis."""
    disturbance = (
        p.disturbance_n * wave(p.disturbance_rad_s * now_s + p.disturbance_phase_rad, p.disturbance_skew)
        if p.disturbance_n > 0.0
        else 0.0
    )
    position = (
        p.position_force_n * math.tanh((table_m - p.position_force_at_m) / p.position_force_width_m)
        if p.position_force_n != 0.0
        else 0.0
    )
    foreign = p.force_step_n if now_s >= p.force_step_at_s else 0.0
    if p.local_force_n != 0.0:
        widths = min(abs(table_m - p.local_force_at_m) / p.local_force_width_m, 50.0)
        foreign += p.local_force_n / math.cosh(widths) ** 2
    relaxation = state.relaxation_n
    if p.relaxation_n_s_m > 0.0:
        relaxation += h * (p.relaxation_n_s_m * table_m_s - relaxation) / p.relaxation_s
        foreign += relaxation
    coupling = p.coupled_kg * coupled_m_s2
    total = p.constant_n + position + disturbance + foreign + coupling + noise_n
    absorber, absorber_m, absorber_m_s = 0.0, state.absorber_m, state.absorber_m_s
    if p.absorber_kg > 0.0:
        absorber = p.absorber_kg * (
            p.absorber_rad_s**2 * (table_m - absorber_m)
            + 2.0 * p.absorber_damping * p.absorber_rad_s * (table_m_s - absorber_m_s)
        )
        absorber_m_s += h * absorber / p.absorber_kg
        absorber_m += h * absorber_m_s
        total += absorber
    of_parts = Load(total, position, disturbance, foreign, coupling, absorber)
    return of_parts, LoadState(relaxation, absorber_m, absorber_m_s)
