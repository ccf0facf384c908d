"""A difference that was put in somewhere is located there, with the share it has; noise is nowhere."""

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from formula_residuals import LEAD_M, N, T, data, residual

from kernels.arrays import Array
from reconcile.catalogue.kinds import RegressionData, ResidualChannel
from reconcile.formats.nominal_axis import NominalAxis
from reconcile.location.coordinates import PHASES, phases
from reconcile.location.locate import LocatedResidual, in_phase, locate, located_json
from reconcile.location.search_bands import order_name
from reconcile.location.spectra import Band, Track
from reconcile.location.spectral_lines import SpectralLine, find_lines
from reconcile.nominal_model.model_file import load_model
from reconcile.regression.filter_ends import FILTER_HZ
from reconcile.regression.state_filter import StateFilter

Effect = Callable[[RegressionData], Array]

MODEL = """
[axis.x]
transmission.lead_mm = 5.0
motor.torque_constant_nm_a = 0.4
table.mass_kg = 50.0
"""


@pytest.fixture(scope="module")
def axis(tmp_path_factory: pytest.TempPathFactory) -> NominalAxis:
    file: Path = tmp_path_factory.mktemp("model") / "model.toml"
    file.write_text(MODEL, encoding="utf-8")
    return load_model(file).axes["x"]


LEVELS = {"constant", "direction"}


def first(effect: Effect, axis: NominalAxis) -> LocatedResidual:
    """The best coordinate beside the levels, which a motion that is not even makes of anything."""
    return next(
        one for one in locate([residual(effect)], ResidualChannel.FORCE, axis) if one.coordinate not in LEVELS
    )


def true_share(effect: Effect) -> float:
    """Of the variance, behind the filter."""
    whole, noise = residual(effect), residual()
    used = whole.used
    put_in = (whole.refitted - noise.refitted)[used]
    return float(put_in.var() / whole.refitted[used].var())


CASES: dict[str, tuple[Effect, str, bool]] = {
    "over the travel, alike both ways": (
        lambda s: 2.0 * np.cos(s.motion.position_m / 8e-3),
        "position",
        False,
    ),
    "over the travel, against the motion": (
        lambda s: s.motion.last_direction * 2.0 * np.cos(s.motion.position_m / 8e-3),
        "position",
        True,
    ),
    "at low speed": (
        lambda s: 4.0 * s.motion.last_direction * np.exp(-((s.motion.velocity_m_s / 2e-3) ** 2)),
        "speed",
        True,
    ),
    "with the acceleration": (lambda s: 4.0 * s.motion.acceleration_m_s2, "acceleration", False),
    "after a reversal": (
        lambda s: -4.0 * s.motion.last_direction * np.exp(-s.motion.distance_since_reversal_m / 2e-3),
        "distance_since_reversal",
        True,
    ),
    "as the run goes on": (lambda s: 0.1 * s.motion.last_direction * (s.time_s - 12.0), "run_time", True),
}


@pytest.mark.parametrize("name", CASES)
def test_a_difference_is_located_where_it_was_put(name: str, axis: NominalAxis) -> None:
    effect, coordinate, by_direction = CASES[name]
    found = first(effect, axis)
    assert (found.coordinate, found.by_direction) == (coordinate, by_direction)
    # a step is blurred by the filter, a steep law by the bins: a little less than all of it is explained
    assert 0.7 * true_share(effect) < found.share < true_share(effect) + 0.02


def test_a_level_is_attributed_to_one_coordinate_once(axis: NominalAxis) -> None:
    found = locate([residual(lambda s: 1.5 + 2.0 * s.motion.last_direction)], ResidualChannel.FORCE, axis)
    shares = {one.coordinate: one.share for one in found}
    assert shares["direction"] == pytest.approx(4.0 / 6.25, abs=0.08)
    assert shares["constant"] == pytest.approx(2.25 / 6.25, abs=0.08)
    assert max(share for name, share in shares.items() if name not in LEVELS) < 0.05


def test_noise_is_located_nowhere(axis: NominalAxis) -> None:
    for seed in range(4):
        shares = {
            one.coordinate: one.share for one in locate([residual(seed=seed)], ResidualChannel.FORCE, axis)
        }
        assert max(shares.values()) < 0.01, shares


def test_a_ripple_is_an_order_and_a_hum_a_frequency(axis: NominalAxis) -> None:
    ripple = first(lambda s: np.sin(2.0 * math.pi * s.motion.position_m / LEAD_M * 3.0 + 1.0), axis)
    assert (ripple.coordinate, ripple.label) == ("order", "3 a turn")
    assert ripple.peak_at == pytest.approx(3.0, abs=0.05)
    hum = first(lambda s: np.sin(2.0 * math.pi * 17.3 * s.time_s), axis)
    assert (hum.coordinate, hum.unit) == ("frequency", "Hz")
    assert hum.peak_at == pytest.approx(17.3, abs=0.05)
    assert hum.peak == pytest.approx(abs(1.0 / (1.0 + 17.3j / FILTER_HZ)) ** 3, rel=0.05)


def test_a_re_zeroed_encoder_does_not_hide_a_ripple(axis: NominalAxis) -> None:
    def ripple(phase: float) -> Effect:
        return lambda s: np.sin(2.0 * math.pi * s.motion.position_m / LEAD_M + phase)

    both = [residual(ripple(0.0)), residual(ripple(math.pi), seed=1)]
    found = locate(both, ResidualChannel.FORCE, axis)[0]
    assert (found.coordinate, found.label) == ("order", "1 a turn")


def test_the_differing_recording_is_named(axis: NominalAxis) -> None:
    both = [residual(source="a"), residual(lambda _: np.full(N, 2.0), seed=1, source="b")]
    by_name = {one.coordinate: one for one in locate(both, ResidualChannel.FORCE, axis)}
    assert by_name["recording"].share > 0.3
    assert by_name["recording"].labels == ("a", "b")


def test_temperature_is_a_coordinate_where_it_was_recorded(axis: NominalAxis) -> None:
    warm = data(temperature=True)
    assert warm.temperature_k is not None
    drift = 0.3 * (warm.temperature_k - 299.0)
    found = locate([residual(lambda _: drift, of=warm)], ResidualChannel.FORCE, axis)
    assert "temperature" in {one.coordinate for one in found if one.share > 0.2}
    assert "temperature" not in {one.coordinate for one in locate([residual()], ResidualChannel.FORCE, axis)}


def test_the_range_holds_where_the_excess_is(axis: NominalAxis) -> None:
    def bump(s: RegressionData) -> Array:
        return np.where(np.abs(s.motion.position_m - 0.01) < 4e-3, 5.0, 0.0)

    found = first(bump, axis)
    assert found.coordinate == "position"
    assert found.low == pytest.approx(0.006, abs=2.5e-3)
    assert found.high == pytest.approx(0.014, abs=2.5e-3)
    assert 0.006 < found.peak_at < 0.014


def test_orders_have_the_names_of_poles_and_of_the_grating(axis: NominalAxis) -> None:
    def line(cycles: float) -> SpectralLine:
        return SpectralLine(cycles, 0.05, 1.0, 0.5)

    known = axis._replace(lead_m=5e-3, pole_pairs=4, grating_m=20e-6)
    assert [order_name(line(w), known) for w in (1.0, 4.0, 24.0, 250.0, 500.0, 1.5)] == [
        "1 a turn",
        "1 a pole pair",
        "6 a pole pair",
        "1 a grating period",
        "2 a grating period",
        "",
    ]


def test_phases_are_those_of_the_motion() -> None:
    s = data()
    names = np.array(PHASES)[phases(s)]
    t = s.time_s
    assert (names[(t > 9.7) & (t < 9.8)] == "standstill").all()
    started = np.flatnonzero(np.diff(s.motion.standing_still.astype(int)) < 0)[0] + 1
    assert (names[started : started + 90] == "breakaway").all()
    turned = np.flatnonzero(np.diff(s.motion.last_direction) != 0.0)[1] + 1
    assert (names[turned : turned + 90] == "reversal").all()
    assert {"constant speed", "acceleration"} <= set(names)


def test_a_residual_is_brought_into_phase_with_the_motion() -> None:
    t = np.arange(N) * T
    for hz in (2.0, 20.0, 50.0):
        late = StateFilter(T, FILTER_HZ)(np.sin(2.0 * math.pi * hz * t))
        weaker = abs(1.0 / (1.0 + 1j * hz / FILTER_HZ)) ** 3
        found = in_phase(residual()._replace(refitted=late), late)
        middle = slice(1000, N - 1000)
        assert found[middle] == pytest.approx(weaker * np.sin(2.0 * math.pi * hz * t)[middle], abs=0.01)


def test_json_has_the_location(axis: NominalAxis) -> None:
    entry = located_json("x", first(lambda s: 2.0 * np.cos(s.motion.position_m / 8e-3), axis))
    assert (entry["axis"], entry["sensor"], entry["coordinate"]) == ("x", "force", "position")
    assert entry["range"][0] < entry["range"][1]


def test_a_recording_of_which_nothing_is_left_changes_no_line() -> None:
    time_s = np.arange(0.0, 8.0, 2e-3)
    of_ones, blocks = np.ones_like(time_s), (time_s // 1.0).astype(np.int64)
    hum = Track(np.sin(2.0 * math.pi * 7.0 * time_s), time_s, of_ones, of_ones, blocks)
    nothing = Track(*(column[:0] for column in hum))
    [alone] = find_lines([hum], [Band(2.0, 20.0)], [np.empty(0)])
    [beside] = find_lines([hum, nothing], [Band(2.0, 20.0)], [np.empty(0)])
    assert alone.cycles == pytest.approx(7.0, abs=0.01)
    half = alone._replace(
        amplitude=alone.amplitude / math.sqrt(2.0)
    )  # it is the root of the mean over recordings
    assert beside == pytest.approx(half)
