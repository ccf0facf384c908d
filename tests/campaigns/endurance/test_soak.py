"""A short soak: all counts agree, and a run releases all resources of the process."""

import gc
from pathlib import Path

import numpy as np
import pytest

from servo_ctrl.config.load import load_machine
from tests.campaigns.endurance.process_resources import Sample, sample, slope
from tests.campaigns.endurance.rig import CSP_TABLE, MACHINE, rig, station
from tests.campaigns.endurance.soak import Soak, leaks
from tests.campaigns.endurance.soak_summary import progress_line, summary


@pytest.mark.parametrize(("folder", "least_cycles"), [(MACHINE, 2000), (CSP_TABLE, 20)])
async def test_counts_agree_and_runs_release_their_resources(
    tmp_path: Path, folder: Path, least_cycles: int
) -> None:
    async with (
        rig("lockstep", machine=folder) as table,
        station("counting_station", str(table.socket)) as observer,
    ):
        soak = Soak(load_machine(folder), tmp_path, "lockstep", recordings_kept=1)
        soak.use_rig(table, observer)
        await soak.run(1.0)  # in the first run libraries open files that stay open
        outcomes = [await soak.run(1.0) for _ in range(2)]
    for outcome in outcomes:
        assert outcome.faults == []
        assert outcome.counts.rows == outcome.counts.syncs == outcome.report.cycles > least_cycles
        assert set(outcome.counts.set_points) == {"201", "202"}
        assert set(outcome.counts.answers) == {"181", "182", "18B", "18C"}
    assert leaks(outcomes) == []
    assert [path.name for path in soak.recordings.present()] == ["run-000003"]
    totals = summary([progress_line("s", soak, outcome) for outcome in outcomes])
    assert totals["counts"]["rows"] == totals["counts"]["syncs"] == sum(o.report.cycles for o in outcomes)
    assert totals["faults"] == []


HOURS = np.linspace(0.0, 10.0, 400)
NOISE_MIB = np.random.default_rng(8).normal(0.0, 0.3, 400)


@pytest.mark.parametrize(
    ("growth_mib_per_h", "verdict"),
    [(0.0, "flat"), (0.2, "flat"), (1.0, "too short to tell"), (3.0, "grows")],
)
def test_growth_is_found_beside_noise(growth_mib_per_h: float, verdict: str) -> None:
    growth = slope(HOURS.tolist(), (100.0 + growth_mib_per_h * HOURS + NOISE_MIB).tolist())
    assert growth.low <= growth_mib_per_h <= growth.high
    assert growth.high - growth.low < 0.3
    assert growth.verdict(1.0) == verdict


def test_warm_up_is_no_growth() -> None:
    warming = 100.0 + 50.0 * np.minimum(HOURS, 1.0) + NOISE_MIB
    assert slope(HOURS.tolist(), warming.tolist()).verdict(1.0) == "flat"


def test_samples_of_one_cycle_and_equal_readings_have_an_interval() -> None:
    """Unpooled, 40 equal readings at four distinct times have a variance below zero."""
    growth = slope(np.repeat(np.arange(5.0), 10).tolist(), [100.0] * 50)
    assert growth == (0.0, 0.0, 0.0, 4, 3.0)


def test_few_samples_give_no_trend() -> None:
    assert slope([0.0, 0.1, 0.2], [1.0, 2.0, 3.0]).verdict(1.0) == "too short to tell"


def test_caches_that_fill_at_first_are_no_growth() -> None:
    minutes = np.linspace(0.0, 5.0, 400)
    growth = slope((minutes / 60.0).tolist(), (300.0 + 4.0 * minutes + NOISE_MIB).tolist())
    assert growth.low > 100.0
    assert growth.verdict(1.0) == "too short to tell"


def test_measuring_does_not_change_the_measured_memory() -> None:
    samples: list[Sample] = []
    gc.collect()
    gc.disable()
    try:
        for _ in range(12):
            samples.append(sample(1.0, {}, len(samples)))
    finally:
        gc.enable()
    assert abs(samples[-1].objects - samples[5].objects) <= 5
