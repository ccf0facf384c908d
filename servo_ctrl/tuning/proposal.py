"""Gains, feedforward and notch from a measured plant: the stiffest axis that keeps a stated Ms.

`gain_search` says what stiff means and which constraints hold. A notch is proposed only where it is worth it.
Feedforward is 1 and the measured mass. An input shaper is reported for what rings while the motor is held.
"""

import math
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array
from servo_ctrl.control.axis_loop import Plant, integrators_of, loop_of
from servo_ctrl.control.compensation import notch
from servo_ctrl.control.modal_model import ModalModel, StructuralMode, antiresonances, resonances
from servo_ctrl.control.tick import AxisParams
from servo_ctrl.control.types import Output
from servo_ctrl.tuning.contour_partner import ContourPartner
from servo_ctrl.tuning.frequency_response import FrequencyResponse
from servo_ctrl.tuning.gain_search import INFEASIBLE, EncoderSteps, GainSearch
from servo_ctrl.tuning.loop import Margins, margins_of, plant_of

SHAPER_DAMPING, SHAPER_HZ = 0.1, 150.0
"""Damping ratio and frequency up to which an input shaper is worth its delay. Chosen, as those below."""
NOTCH_GAIN = 0.1
"""Least reduction of the cost, a logarithm, for which a notch is proposed."""
DIGITS = 3
"""Significant digits of a proposed value."""


class NotchValues(NamedTuple):
    """Keys of the notch section."""

    frequency_hz: float
    damping_ratio: float
    depth: float


class ShaperValues(NamedTuple):
    """Keys of the input shaper's section."""

    frequency_hz: float
    damping_ratio: float


class Assessment(NamedTuple):
    """A setting on the measured plant."""

    plant: Plant
    margins: Margins
    compliance_m_n: float
    """Peak of |P / (1 + L)|."""


class ContourMargin(NamedTuple):
    """Ms of the axis and the one that contour control couples to it."""

    partner: str
    partner_measured: bool
    """Whether the machine file has the measured plant of the partner; else it is its rigid mass."""
    sensitivity_peak: float


class Proposal(NamedTuple):
    """Proposed keys of the machine file, and the assessment of the loop with them."""

    kp_1_s: float
    kv_n_s_m: float
    ki_n_m: float
    velocity_feedforward: float
    acceleration_feedforward_kg: float
    notch: NotchValues | None
    params: AxisParams
    """The parameters of the axis with these values."""
    assessment: Assessment
    resonances: tuple[StructuralMode, ...]
    shaper: ShaperValues | None
    """Against what rings while the motor is held. Reported only: all axes of a path need the same shaper."""
    contour: ContourMargin | None
    """None where no contour control couples the axis to another one."""


def propose(
    params: AxisParams,
    model: ModalModel,
    measured: FrequencyResponse,
    ms: float,
    steps: EncoderSteps,
    *,
    largest_kp_1_s: float = math.inf,
    partner: ContourPartner | None = None,
) -> Proposal:
    """Propose the best setting of a cst axis whose position gain is at most `largest_kp_1_s`.

    `partner`: the axis that contour control couples to it. Raises ValueError where no setting keeps the
    constraints.
    """
    if params.output != int(Output.FORCE):
        raise ValueError("only mode cst has a velocity loop that can be tuned here")
    search = GainSearch(
        params, model, measured=measured, ms=ms, steps=steps, largest_kp_1_s=largest_kp_1_s, partner=partner
    )
    cost, values = search.best(None)
    for mode in resonances(model):
        if mode.frequency_hz >= 0.49 / params.period_s:
            continue
        notched_cost, notched = search.best(mode)
        if notched_cost < cost - NOTCH_GAIN:
            cost, values = notched_cost, notched
    if cost >= 0.5 * INFEASIBLE:
        raise ValueError(f"no gains keep Ms at {ms:g} with this plant: check its resonances and its delay")
    rounded = np.log([_rounded(value) for value in np.exp(values)])
    if search.cost(rounded) >= 0.5 * INFEASIBLE:
        rounded[:3] -= 0.01  # the rounded values violate a constraint: 1 % less gain keeps it
    return _proposal(search, measured, rounded, partner)


def _proposal(
    search: GainSearch, measured: FrequencyResponse, values: Array, partner: ContourPartner | None
) -> Proposal:
    best = search.with_values(values)
    kv, ki = _rounded(best.velocity_loop.kv_n_s_m), _rounded(best.velocity_loop.ki_n_m)
    kp, mass_kg = _rounded(best.position_loop.kp_1_s), _rounded(search.model.mass_kg)
    filters = None
    if len(values) > 3:
        filters = NotchValues(*(_rounded(float(value)) for value in np.exp(values[3:])))
    params = best._replace(
        position_loop=best.position_loop._replace(kp_1_s=kp),
        velocity_loop=best.velocity_loop._replace(kv_n_s_m=kv, ki_n_m=ki),
        feedforward=best.feedforward._replace(velocity=1.0, acceleration_kg=mass_kg),
        notch=notch.NEUTRAL if filters is None else notch.biquad(*filters, best.period_s),
    )
    assessment, contour = assess(params, search.model, measured), None
    if partner is not None:
        peak = partner.on(search.plant).sensitivity_peak(params)
        contour = ContourMargin(partner.name, bool(partner.measured), peak)
    return Proposal(
        kp,
        kv,
        ki,
        velocity_feedforward=1.0,
        acceleration_feedforward_kg=mass_kg,
        notch=filters,
        params=params,
        assessment=assessment,
        resonances=resonances(search.model),
        shaper=_shaper(search.model),
        contour=contour,
    )


def _shaper(model: ModalModel) -> ShaperValues | None:
    """For the lowest lightly damped antiresonance; None where all are well damped."""
    for hz, damping in antiresonances(model):
        if damping < SHAPER_DAMPING and hz < SHAPER_HZ and resonances(model):
            return ShaperValues(_rounded(hz), _rounded(damping))
    return None


def assess(params: AxisParams, model: ModalModel, measured: FrequencyResponse) -> Assessment:
    """Assess a setting on the plant of the model, corrected by what was measured."""
    plant = plant_of(model, measured, scale_feedback=params.position_loop.scale_feedback)
    loop = loop_of(params, plant)
    compliance_m_n = float(np.max(np.abs(plant.feedback / (1.0 + loop))))
    margins = margins_of(loop, plant.frequency_hz, integrators_of(params))
    return Assessment(plant, margins, compliance_m_n)


def _rounded(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")
