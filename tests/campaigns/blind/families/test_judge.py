"""The sealed truth tells the size of what is concealed: a force of known RMS, on a motion by hand."""

from collections.abc import Sequence

import numpy as np
import pytest

from tests.campaigns.blind.families.interface import Array, Case, Channels, Effect, Nominal
from tests.campaigns.blind.families.judge import drawn

PERIOD_S, SECONDS = 1e-3, 10.0
TRAVEL_M = 0.1 * np.pi
SOUND = Nominal(inertia=2.0, viscous=3.0, coulomb=1.0, motor_count=1e-9)


def case_of(size_n: float, noise_n: float, harmonic: float | None = None) -> Case:
    """Return an axis that goes to and fro at one speed; a force of 10 Hz acts on it and nothing reacts."""
    time = np.arange(0.0, SECONDS, PERIOD_S)
    x = 0.1 * np.arcsin(np.sin(2.0 * np.pi * 0.23 * time + 0.3))
    v = np.gradient(x, PERIOD_S)

    def simulate(names: frozenset[str], noisy: bool, foreign: Sequence[Array] | None) -> list[Channels]:
        force = SOUND.viscous * v + SOUND.coulomb * np.sign(v) + SOUND.inertia * np.gradient(v, PERIOD_S)
        if "ripple" in names:
            force = force + size_n * np.sin(2.0 * np.pi * 10.0 * time)
        if noisy:
            force = force + noise_n * np.random.default_rng(1).standard_normal(len(time))
        assert foreign is None
        return [{"time": time, "motor": x, "force": force, "command": x}]

    known = {} if harmonic is None else {"harmonic": harmonic}
    return Case("by_hand", 1, "single", SOUND, SOUND, (Effect("ripple", known),), simulate)


def test_the_truth_states_the_rms_of_a_force_of_known_size() -> None:
    truth = drawn(case_of(5.0, 1.0)).truth
    effect = truth["effects"][0]  # type: ignore[index]
    moving = 1.0 - 2.0 * 0.2 / SECONDS  # the edges of the low pass do not count
    passed = 1.0 / (1.0 + (10.0 / 40.0) ** 4)  # Butterworth of second order, forward and backward
    assert effect["rms"] == pytest.approx(5.0 / np.sqrt(2.0) * passed * np.sqrt(moving), rel=0.01)
    band = 2.0 * 40.0 * PERIOD_S * 1.11 * 0.75  # share of white noise that passes twice: 3/4 of once
    assert effect["floor"] == pytest.approx(np.sqrt(band * moving), rel=0.1)
    assert effect["observable"]


@pytest.mark.parametrize(("size_n", "why"), [(0.01, "smaller than the noise"), (5.0, "")])
def test_an_effect_is_observable_from_the_noise_on(size_n: float, why: str) -> None:
    effect = drawn(case_of(size_n, 1.0)).truth["effects"][0]  # type: ignore[index]
    assert effect["why_not"] == why


@pytest.mark.parametrize(
    ("periods", "why"), [(1.9, "fewer than two of its periods are travelled"), (2.1, "")]
)
def test_what_comes_back_is_observable_from_two_periods_on(periods: float, why: str) -> None:
    case = case_of(5.0, 1.0, harmonic=periods * SOUND.lead_m / TRAVEL_M)
    effect = drawn(case).truth["effects"][0]  # type: ignore[index]
    assert (effect["why_not"], effect["observable"]) == (why, not why)
