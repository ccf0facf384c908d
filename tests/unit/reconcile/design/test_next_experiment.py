"""The next experiment: the motion with the largest expected evidence within the limits, as a program file."""

import json
from pathlib import Path

import numpy as np
import pytest
from known_axis import AXIS, COULOMB_N, explanation_of, identified_effect, motion_m

from hil_sim.config.load import EFFECT_PARAMS
from reconcile.catalogue.registry import CATALOGUE, ENTRIES, distinguishing_observation
from reconcile.design.candidate_motions import candidate_motions, plan_motion
from reconcile.design.limits import AxisLimits
from reconcile.design.manual_experiment import MANUAL_EXPERIMENTS
from reconcile.design.next_experiment import MIN_NATS, NextExperiment, next_experiment
from reconcile.design.program import PROGRAM_FILE, write_program
from reconcile.report.experiment_text import paragraph

LIMITS = AxisLimits(-0.05, 0.05, 0.2, 2.0, 100.0, 0.0)
SINE = motion_m("sine")


def asked(*findings: object, made: tuple[str, ...] = ()) -> NextExperiment:
    return next_experiment({"x": [explanation_of([SINE], findings)]}, {"x": AXIS}, {"x": LIMITS}, made)


CONTESTED = identified_effect("stribeck_friction", (4e-3,), 3.0, rivals=[("quadratic_viscous_friction", 0.4)])


@pytest.fixture(scope="module")
def contested() -> NextExperiment:
    return asked(CONTESTED)


def test_rival_names_are_discriminated_with_the_gain_of_every_motion(contested: NextExperiment) -> None:
    content = contested.content
    assert content["separates"] == ["stribeck_friction", "quadratic_viscous_friction"]
    assert content["evidence_nats"] >= MIN_NATS
    assert content["evidence_nats"] > 5.0 * content["instead"]["evidence_nats"]
    assert content["tells"] == distinguishing_observation("stribeck_friction", "quadratic_viscous_friction")
    assert json.loads(json.dumps(content)) == content


def test_report_gives_the_expected_gain_and_that_of_other_motions(contested: NextExperiment) -> None:
    content = contested.content
    text = paragraph(content)
    assert f"by {content['evidence_nats']:g} nats in {content['seconds']:g} s" in text
    assert f"{content['instead']['motion']} would by {content['instead']['evidence_nats']:g}" in text
    assert f"servo-ctrl run --program {PROGRAM_FILE}" in text


def test_a_repeated_motion_has_less_gain(contested: NextExperiment) -> None:
    assert asked(CONTESTED, made=(contested.kind,) * 9).kind != contested.kind


def test_effects_that_the_recordings_would_have_shown_are_no_question() -> None:
    """The effects have the size of those of real machines, and the recordings every kind of motion."""
    everything = [motion_m(kind) for kind in ("slow speeds", "small strokes", "fast moves")]
    of_all = explanation_of(everything, [], noise_n=0.05)
    of_one = explanation_of([SINE], [], noise_n=0.05)
    before, after = (
        next_experiment({"x": [of]}, {"x": AXIS}, {"x": LIMITS}).content for of in (of_one, of_all)
    )
    assert len(before["also"]) > len(after.get("also", []))


def test_every_motion_of_the_pool_stays_within_the_limits_and_comes_home() -> None:
    motions = candidate_motions(LIMITS, 1e-3, 1e-5, 1e-7)
    assert len({one.motion.kind for one in motions}) >= 11
    for one in motions:
        x = one.position_m
        v = np.diff(x) / 1e-3
        assert LIMITS.min_position_m <= x.min() <= x.max() <= LIMITS.max_position_m, one.motion.words
        assert np.abs(v).max() <= 1.001 * LIMITS.velocity_m_s, one.motion.words
        assert np.abs(np.diff(v)).max() / 1e-3 <= 1.06 * LIMITS.acceleration_m_s2, one.motion.words
        assert abs(x[-1] - LIMITS.home_m) < 1e-8
        assert one.seconds < 100.0


def test_motions_beyond_the_limits_are_left_out() -> None:
    long = next(
        one.motion for one in candidate_motions(LIMITS, 1e-3, 1e-5, 1e-7) if one.motion.kind == "long strokes"
    )
    assert plan_motion(long, LIMITS._replace(max_position_m=0.01), 1e-3) is None


def test_a_sensor_is_requested_where_no_motion_discriminates() -> None:
    screw = identified_effect(
        "constant_force", (), 0.2 * COULOMB_N, equivalent=["asymmetric_coulomb_friction"]
    )
    still = AxisLimits(-1e-9, 1e-9, 1e-6, 1e-6, 1e-3, 0.0)  # nothing of the pool fits in there
    found = next_experiment({"x": [explanation_of([SINE], [screw])]}, {"x": AXIS}, {"x": still})
    assert found.content["motion"] == MANUAL_EXPERIMENTS["breakaway"].motion
    assert found.program == []


def test_a_settled_question_removes_the_old_program(tmp_path: Path, contested: NextExperiment) -> None:
    file = write_program(contested.program, contested.content["why"], tmp_path)
    assert file is not None
    assert file.name == PROGRAM_FILE
    assert contested.content["why"] in file.read_text(encoding="utf-8")
    assert write_program([], "", tmp_path) is None
    assert not file.exists()


def test_every_rule_names_known_effects_and_every_effect_has_a_rule() -> None:
    for entry in CATALOGUE.values():
        assert {entry.name, *(rival.effect for rival in entry.rivals)} <= set(EFFECT_PARAMS)
        for rival in entry.rivals:
            assert distinguishing_observation(entry.name, rival.effect)
            assert rival.experiment in {"", *MANUAL_EXPERIMENTS}
        assert entry.experiment in {"", *MANUAL_EXPERIMENTS}
    assert all(entry.shown_by for entry in ENTRIES.values())


@pytest.mark.parametrize("experiment", MANUAL_EXPERIMENTS)
def test_experiments_beyond_a_motion_have_numbers(experiment: str) -> None:
    from reconcile.design.recorded_axis import recorded_axis  # noqa: PLC0415

    seen = recorded_axis([explanation_of([SINE], [])], AXIS)
    assert MANUAL_EXPERIMENTS[experiment].numbers(seen)
