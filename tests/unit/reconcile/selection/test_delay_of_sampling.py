"""A delay within a cycle is how the channels were sampled: it is fitted where it shows, and never named.

A drive that holds its current over a cycle, sampled at the end, is half a cycle late. Only abrupt motion
shows it, and a program may have a few blocks of that: too few for a significant term.
"""

import math

import numpy as np
import pytest
from known_axis import AXIS, COULOMB_N, COUNT_M, MASS_KG, VISCOUS_N_S_M, T

from kernels.arrays import Array
from reconcile.catalogue.kinds import ResidualChannel
from reconcile.identification.explain import Explanation, explain
from reconcile.identification.term_search import TermSearch
from reconcile.recording.recording import AxisRecording
from reconcile.selection.selection_rules import SelectionRules

ABRUPT_S = (4.0, 12.0)
UNIT_N = 0.4
"""Unit of the current on the bus, at the table."""


def motion_at(time_s: Array) -> tuple[Array, Array, Array]:
    """Position, velocity and acceleration (n,): a slow sine with two quick steps of 1 mm, 40 ms long."""
    rad_s = 2.0 * math.pi * 0.05
    position = 0.02 * np.sin(rad_s * time_s)
    velocity, acceleration = 0.02 * rad_s * np.cos(rad_s * time_s), -(rad_s**2) * position
    for start_s in ABRUPT_S:
        u = np.clip((time_s - start_s) / 0.04, 0.0, 1.0)
        position = position + 1e-3 * (10.0 * u**3 - 15.0 * u**4 + 6.0 * u**5)
        velocity = velocity + 1e-3 / 0.04 * 30.0 * (u * (1.0 - u)) ** 2
        acceleration = acceleration + 1e-3 / 0.04**2 * 60.0 * u * (1.0 - u) * (1.0 - 2.0 * u)
    return position, velocity, acceleration


def explained(delay_s: float) -> Explanation:
    time_s = np.arange(20_000) * T
    position_m = motion_at(time_s)[0]
    _, velocity_m_s, acceleration_m_s2 = motion_at(time_s - delay_s)
    force_n = MASS_KG * acceleration_m_s2 + VISCOUS_N_S_M * velocity_m_s + COULOMB_N * np.sign(velocity_m_s)
    recording = AxisRecording(
        source="motion",
        axis="x",
        period_s=T,
        time_s=time_s,
        motor_m=np.rint(position_m / COUNT_M) * COUNT_M,
        force_n=np.rint(force_n / UNIT_N) * UNIT_N,
        scale_m=None,
        reference_m=None,
        temperature_k=None,
        others={},
    )
    return explain(TermSearch([recording], AXIS, ResidualChannel.FORCE, SelectionRules()))


def test_half_a_cycle_is_fitted_where_two_steps_show_it() -> None:
    explanation = explained(0.5 * T)
    assert explanation.timing_s == pytest.approx(-0.5 * T, rel=0.2)
    assert explanation.findings == []


def test_three_cycles_in_two_steps_are_neither_sampling_nor_significant() -> None:
    assert explained(3.0 * T).timing is None
