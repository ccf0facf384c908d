"""The simulated queue of a fleet takes what can be worked out by hand."""

import pytest

from tests.campaigns.fleet.scheduling import Fleet, simulated

HOUR_S = 3600.0


def test_one_worker_takes_the_sum_of_its_tasks() -> None:
    done = simulated(Fleet(1000, 1, 0.0), [10.0])
    assert done.hours * HOUR_S == pytest.approx(10_000.0)
    assert done.busy == pytest.approx(1.0)


def test_many_workers_share_equal_tasks_in_rounds() -> None:
    assert simulated(Fleet(1000, 300, 0.0), [10.0]).hours * HOUR_S == pytest.approx(
        40.0
    )  # 300 + 300 + 300 + 100


def test_a_slow_client_is_the_limit() -> None:
    done = simulated(Fleet(2000, 400, 0.05), [10.0])
    assert done.hours * HOUR_S == pytest.approx(10.0 + 2000 * 0.05, rel=0.01)
    assert done.client_busy == pytest.approx(1.0, abs=0.12)


def test_a_client_that_keeps_up_costs_only_the_last_task() -> None:
    done = simulated(Fleet(1000, 10, 0.001), [10.0])
    assert done.hours * HOUR_S == pytest.approx(1000.0, rel=0.002)


def test_a_lost_worker_costs_the_task_that_it_had() -> None:
    whole = simulated(Fleet(20_000, 100, 0.0), [12.0])
    losing = [simulated(Fleet(20_000, 100, 0.0, losses_an_hour=1.0), [12.0], seed) for seed in range(1, 6)]
    worker_hours = 20_000 * 12.0 / HOUR_S
    assert sum(done.lost for done in losing) / 5 == pytest.approx(worker_hours, rel=0.2)  # one loss in each
    assert all(whole.hours < done.hours < 1.02 * whole.hours for done in losing)
