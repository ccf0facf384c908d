"""Physics refuses what cannot be, and says why; what can be passes, whatever its size."""

import itertools
import math

import numpy as np
import pytest
from formula_residuals import LEAD_M, data
from known_axis import AXIS

from reconcile.catalogue.conversion import ModelTerm
from reconcile.catalogue.heat_balance import temperature_changes
from reconcile.catalogue.kinds import RegressionData, ResidualChannel
from reconcile.catalogue.registry import ENTRIES
from reconcile.catalogue.veto import VetoContext, collinearity, veto

FORCE, DEVIATION = ResidualChannel.FORCE, ResidualChannel.POSITION_DEVIATION
BASE = {"mass_kg": 50.0, "viscous_n_s_m": 100.0, "coulomb_n": 12.0}


def refused(
    effect: str,
    shape: tuple[float, ...],
    coefficients: tuple[float, ...],
    of: RegressionData | None = None,
    **context: object,
) -> str:
    channel = ENTRIES[effect].terms[0].channel
    terms = [ModelTerm(effect, shape, coefficients, channel)]
    given = VetoContext([of or data()], AXIS, BASE if channel is FORCE else {}, terms)
    return veto(ENTRIES[effect], terms, given._replace(**context))


def within(of: RegressionData, range_m: float) -> RegressionData:
    """The same motion over another range of positions."""
    m = of.motion
    scaled_m = m.position_m * range_m / float(np.ptp(m.position_m))
    return of._replace(motion=m._replace(position_m=scaled_m))


@pytest.mark.parametrize(
    ("effect", "shape", "coefficients", "why"),
    [
        ("backlash", (2e-6, math.inf, 0.0), (-2e-6,), "lies between 0 and inf in nature"),
        ("backlash", (3e-5, math.inf, 0.0), (2e-6,), "steps by 6.7 % of what the motor crosses"),
        ("presliding_hysteresis", (8e-6, 1.0), (-3.0,), "lies between 0 and inf"),
        ("cogging", (4.0,), (math.nan, 1.0), "not finite"),
        ("torque_ripple", (6.0,), (3.61, 0.0), "relative amplitude A_k would be 3.61"),
        ("transport_delay", (8e-3,), (9.0,), "delay tau would be 72 ms"),
        ("lead_error_cumulative", (), (0.02,), "would be 2e+04 um/m, and is -10000 to 10000"),
        ("periodic_disturbance", (430.0,), (1.0, 1.0), "above the 400 Hz"),
        ("stribeck_friction", (0.05,), (-40.0,), "would push"),
        ("asymmetric_viscous_friction", (), (-900.0,), "would push"),
        ("position_dependent_friction", (1.0, 0.0, 0.03), (30.0,), "would push"),
        ("temperature_dependent_friction", (300.0, 0.0), (2.0, 1.0), "a straight line over time"),
        (
            "temperature_dependent_friction",
            (1.0, 0.0),
            (480.0, 0.0),
            "ratio w of hot to cold friction levels would be 43.11, and is 0 to 20",
        ),
    ],
)
def test_the_impossible_is_refused_with_its_reason(
    effect: str, shape: tuple[float, ...], coefficients: tuple[float, ...], why: str
) -> None:
    assert why in refused(effect, shape, coefficients)


@pytest.mark.parametrize(
    ("effect", "shape", "coefficients"),
    [
        ("backlash", (2e-6, math.inf, 0.0), (2e-6,)),
        ("presliding_hysteresis", (8e-6, 1.0), (3.0,)),
        ("cogging", (4.0,), (2.0, 1.0)),
        ("torque_ripple", (6.0,), (0.2, 0.1)),
        ("transport_delay", (8e-3,), (0.5,)),
        ("transport_delay", (2e-4,), (-1.0,)),  # less than a sample: how the channels were sampled
        ("lead_error_cumulative", (), (-4e-5,)),
        ("periodic_disturbance", (37.0,), (1.0, 1.0)),
        ("stribeck_friction", (0.005,), (-9.0,)),
        ("asymmetric_viscous_friction", (), (40.0,)),
        ("position_dependent_friction", (1.0, 0.0, 0.03), (6.0,)),
        ("quadratic_viscous_friction", (), (-300.0,)),
        ("temperature_dependent_friction", (15.0, 0.0), (-4.0, -30.0)),
        ("constant_force", (), (-300.0,)),
        ("cross_axis_coupling", (), ()),
    ],
)
def test_the_possible_passes(effect: str, shape: tuple[float, ...], coefficients: tuple[float, ...]) -> None:
    assert refused(effect, shape, coefficients) == ""


@pytest.mark.parametrize("effect", [name for name, entry in ENTRIES.items() if entry.terms])
def test_every_size_is_judged(effect: str) -> None:
    """Whatever a search has fitted, beside whatever mass and friction: a reason or none, never an error."""
    rng = np.random.default_rng(7)
    for family, of in itertools.product(ENTRIES[effect].terms, (data(), data(temperature=True))):
        for shape in family.shapes([of])[::7]:
            number = family.columns(of, shape).shape[1]
            for _ in range(10 if number else 0):  # this axis has no other beside it
                sizes = rng.choice((-1.0, 1.0), number) * 10.0 ** rng.uniform(-6.0, 6.0, number)
                base = dict(zip(BASE, rng.choice((-1.0, 0.0, 1e-3, 1.0, 1e3), 3).tolist(), strict=True))
                terms = [ModelTerm(effect, shape, tuple(sizes), family.channel)]
                assert isinstance(veto(ENTRIES[effect], terms, VetoContext([of], AXIS, base, terms)), str)


@pytest.mark.parametrize("effect", ["cogging", "torque_ripple", "lead_error_periodic"])
def test_an_effect_per_turn_needs_turns(effect: str) -> None:
    """Two periods and a whole turn: of a third of a turn, twelve a turn are not an effect per turn either."""
    coefficients = (1e-7, 1e-7)
    for turns, harmonic, may_be in (
        (2.0, 1.0, True),
        (1.9, 1.0, False),
        (1.0, 7.0, True),
        (0.3, 12.0, False),
    ):
        short = within(data(), turns * LEAD_M)
        assert (refused(effect, (harmonic,), coefficients, short) == "") == may_be, (turns, harmonic)
        scanned = [shape for shape, *_ in ENTRIES[effect].terms[0].shapes([short])]
        assert (harmonic in scanned or harmonic == 7.0) == may_be
    assert ENTRIES[effect].terms[0].shapes([within(data(), 0.3 * LEAD_M)]) == []


def test_a_grating_shows_over_two_of_its_periods() -> None:
    shapes = ENTRIES["scale_cyclic_error"].terms[0].shapes
    assert max(shape[0] for shape in shapes([data()])) > 1e-4
    assert max(shape[0] for shape in shapes([within(data(), 5e-5)])) == 2e-5


@pytest.mark.parametrize("effect", ["temperature_dependent_friction", "thermal_expansion"])
def test_a_temperature_that_does_not_change_changes_nothing(effect: str) -> None:
    warm = data(temperature=True)
    assert warm.temperature_k is not None
    cool = warm._replace(temperature_k=293.0 + 0.05 * (warm.temperature_k - 293.0))
    rng = np.random.default_rng(3)
    noisy = cool._replace(temperature_k=293.0 + rng.normal(size=len(cool.time_s)))
    assert temperature_changes([warm])
    for one in (cool, noisy):
        assert not temperature_changes([one])
        assert ENTRIES[effect].terms[0].shapes([one]) == []
        assert "changes by less than" in refused(effect, (0.0, 293.0), (1e-6, 1e-6), one)
    assert ENTRIES[effect].terms[0].shapes([warm]) != []


def test_surroundings_are_those_of_machines() -> None:
    """Minus 294 K was once written into a note, and the name beside it at 97 %."""
    assert "surroundings" in refused("thermal_expansion", (30.0, 0.0), (-6e-3, 1e-4, 0.0))
    assert refused("thermal_expansion", (30.0, 0.0), (6e-5, 1e-5, 0.0)) == ""


def test_a_term_that_is_the_baseline_in_this_motion_is_refused() -> None:
    """A spring under a sine of one frequency is a mass: the position is the acceleration's opposite."""
    time_s = np.arange(4000) * 1e-3
    x, v, a = (np.sin(3.0 * time_s + k * math.pi / 2.0) for k in range(3))
    base = np.stack((a, v, np.sign(v)), axis=1)
    shape = (1.0, 0.0, 1.0)
    beside = {"prediction": 5.0 * x, "baseline": base}
    assert "mass, friction and a constant to 100.0 %" in refused(
        "position_dependent_force", shape, (5.0,), **beside
    )
    mixed = np.sin(7.1 * time_s)
    beside["prediction"] = 5.0 * (x + mixed)
    assert refused("position_dependent_force", shape, (5.0,), **beside) == ""
    assert collinearity(np.ones(4000), base) < 0.1  # a constant force is held against the others alone
    assert collinearity(v + 3.0, base) == pytest.approx(1.0)
    x_alone = x - base @ np.linalg.lstsq(base, x, rcond=None)[0]
    assert float(np.linalg.norm(x_alone)) < 1e-9 * float(np.linalg.norm(x))


@pytest.mark.parametrize("effect", ["position_dependent_force", "position_dependent_friction"])
def test_what_depends_on_the_place_needs_a_place_that_is_passed_again(effect: str) -> None:
    to_and_fro = data()
    position_m = np.linspace(-0.03, 0.03, len(to_and_fro.time_s))
    one_way = to_and_fro._replace(motion=to_and_fro.motion._replace(position_m=position_m))
    shape, coefficients = (1.0, 0.0, 0.03), (2.0,)
    assert "may as well depend on the time" in refused(effect, shape, coefficients, one_way)
    assert not refused(effect, shape, coefficients, to_and_fro)
