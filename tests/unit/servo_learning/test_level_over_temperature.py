"""Level of friction over temperature: by hand, within its bounds, and with sensors that tell nothing."""

import math

import numpy as np
import pytest

from servo_ctrl.learning.level_over_temperature import (
    EVIDENCE,
    EVIDENCE_MAX,
    FOLLOW_MIN,
    FORGETTING,
    RANGE_DEGC,
    RATE_1_S,
    STEP_K,
    VARIANCE_NEW,
    LevelNode,
    LevelSchedule,
    followed,
    learned_at,
    level_at,
    relative_to,
)

WARM = LevelSchedule(
    (LevelNode(20.0, 1.2, 0.1), LevelNode(25.0, 1.1, 0.1), LevelNode(40.0, 0.9, 0.1)),
    followed=0.9,
    evidence=EVIDENCE_MAX,
)


def test_the_first_two_reversals_by_hand() -> None:
    first = learned_at(LevelSchedule(), 22.0, 1.0, 0.1)
    low, high = first.nodes
    assert (low.temperature_degc, high.temperature_degc) == (20.0, 25.0)
    assert (low.level, high.level, first.followed) == pytest.approx((1.1, 1.1, 1.1))
    total = 1.0 + (0.6**2 + 0.4**2) * 10.0  # 6.2
    assert low.variance == pytest.approx(10.0 * (1.0 - 0.6**2 * 10.0 / total) / 0.95**0.6)
    second = learned_at(first, 20.0, 1.1, 0.05)
    gain = low.variance / (1.0 + low.variance)
    assert second.nodes[0].level == pytest.approx(1.1 * 1.05**gain)
    assert second.nodes[1] == high
    assert second.followed == second.nodes[0].level


def test_between_nodes_it_is_geometric_and_beyond_them_constant() -> None:
    assert level_at(WARM.nodes, 22.5) == pytest.approx(math.sqrt(1.2 * 1.1))
    assert (level_at(WARM.nodes, 0.0), level_at(WARM.nodes, 60.0)) == (1.2, 0.9)
    assert math.isnan(level_at((), 20.0))
    assert math.isnan(level_at(WARM.nodes, math.nan))


def test_any_form_is_learned_and_what_was_long_ago_is_forgotten() -> None:
    rng = np.random.default_rng(3)
    for offset in (0.0, 0.1):  # friction has changed between: what is known moves along
        schedule = LevelSchedule()
        for _ in range(600):
            degc = float(rng.uniform(15.0, 50.0))
            level = (1.0 + offset) * (1.0 + 0.2 * math.sin(degc / 6.0))
            schedule = learned_at(schedule, degc, level, float(rng.normal(0.0, 0.02)))
        for degc in (20.0, 27.0, 35.0, 45.0):
            assert level_at(schedule.nodes, degc) == pytest.approx(
                (1.0 + offset) * (1.0 + 0.2 * math.sin(degc / 6.0)), rel=0.05
            )


def test_a_change_beyond_what_temperature_explains_moves_every_node() -> None:
    after = learned_at(WARM, 20.0, 1.2, 0.8)
    assert [node.level for node in after.nodes] == pytest.approx([1.8 * node.level for node in WARM.nodes])


def test_the_level_in_use_follows_the_ratio_of_the_table_by_a_bounded_rate() -> None:
    schedule, level, took_s = WARM, 2.0, 0
    while schedule.followed < 1.2 / (1.0 + FOLLOW_MIN):
        schedule, factor = followed(schedule, 20.0, 1.0)
        level, took_s = level * factor, took_s + 1
        assert factor <= math.exp(RATE_1_S) + 1e-12
    assert level == pytest.approx(2.0 * 1.2 / 0.9)
    assert took_s == math.ceil(math.log(1.2 / 0.9) / RATE_1_S)
    assert followed(schedule, 20.1, 1.0) == (schedule, 1.0)  # too little
    assert schedule.moved == pytest.approx(math.log(1.2 / 0.9))
    assert followed(schedule, 20.0, 1.0)[1] == pytest.approx(1.0)


@pytest.mark.parametrize("degc", [math.nan, -math.inf, RANGE_DEGC[0] - 0.1, RANGE_DEGC[1]])
def test_no_reversal_counts_without_a_temperature(degc: float) -> None:
    assert learned_at(WARM, degc, 1.0, 0.1) == WARM


def test_without_a_temperature_or_a_table_the_level_stands_still() -> None:
    assert followed(WARM, math.nan, 1.0) == (WARM, 1.0)
    assert followed(LevelSchedule(), 20.0, 1.0) == (LevelSchedule(), 1.0)
    assert learned_at(WARM, 20.0, 1.0, -1.5) == WARM  # friction of the other sign
    assert learned_at(WARM, 20.0, 1.0, math.nan) == WARM


def test_a_change_that_came_as_predicted_makes_it_act() -> None:
    known = WARM._replace(evidence=0.0)
    assert not known.acts
    assert followed(known, 20.0, 1.0) == (known, 1.0)
    colder = learned_at(known, 20.0, 0.9, 1.2 / 0.9 - 1.0)  # the level was 0.9: friction is 1.2 there
    assert colder.evidence == pytest.approx(0.2**2)  # both changes are bounded to 0.2
    assert colder.acts


def test_predictions_that_were_wrong_stop_it_and_evidence_is_bounded() -> None:
    acting, wrong = WARM, 0
    while acting.acts:
        acting = learned_at(acting._replace(nodes=WARM.nodes, followed=0.9), 20.0, 0.9, 0.0)
        wrong += 1
    assert wrong == 2
    for _ in range(9):
        acting = learned_at(acting._replace(nodes=WARM.nodes, followed=0.9), 20.0, 0.9, 1.0 / 3.0)
    assert acting.evidence == EVIDENCE_MAX
    for _ in range(9):
        acting = learned_at(acting._replace(nodes=WARM.nodes, followed=0.9), 20.0, 0.9, 0.0)
    assert acting.evidence == -EVIDENCE


def test_a_sensor_that_sticks_changes_nothing() -> None:
    schedule, rng = LevelSchedule(), np.random.default_rng(5)
    for growth in rng.normal(0.0, 0.2, 300):
        schedule = learned_at(schedule, 31.4, 1.0, float(growth))
        schedule, factor = followed(schedule, 31.4, 1.0)
        assert (factor, schedule.evidence) == (1.0, 0.0)


def test_a_sensor_of_something_else_seldom_acts_and_then_changes_little() -> None:
    schedule, rng, acted, level = LevelSchedule(), np.random.default_rng(6), 0, 1.0
    for _ in range(2000):
        degc = float(rng.uniform(15.0, 45.0))
        schedule = learned_at(schedule, degc, level, math.exp(rng.normal(0.0, 0.05)) / level - 1.0)
        acted += schedule.acts
        level = 1.0
        schedule, factor = followed(schedule, float(rng.uniform(15.0, 45.0)), 10.0)
        level *= factor
        assert 0.8 < level < 1.25
    assert acted < 400


def test_the_table_is_bounded_by_the_range_of_temperatures() -> None:
    schedule = LevelSchedule()
    for degc in np.linspace(-100.0, 300.0, 4000):
        schedule = learned_at(schedule, float(degc), 1.0, 0.0)
    assert len(schedule.nodes) == (RANGE_DEGC[1] - RANGE_DEGC[0]) / STEP_K + 1
    assert all(0.0 < node.variance <= VARIANCE_NEW for node in schedule.nodes)
    assert schedule.nodes[10].variance > (1.0 - FORGETTING) / 2.0


def test_a_stored_table_is_relative_to_the_stored_waveform() -> None:
    rebased = relative_to(WARM, 0.9)
    assert rebased.followed == 1.0
    assert rebased.nodes[0].level == pytest.approx(1.2 / 0.9)
    assert followed(rebased, 20.0, 1.0)[1] == pytest.approx(followed(WARM, 20.0, 1.0)[1])
    assert rebased.evidence > EVIDENCE
