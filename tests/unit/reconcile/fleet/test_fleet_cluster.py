"""Workers that die, tasks that kill workers, tasks that never end: real processes, small tasks."""

import os
from collections.abc import Iterator
from pathlib import Path

import fleet_stubs
import pytest
from fleet_stubs import StubTask

from reconcile.errors import ReconcileError
from reconcile.fleet.cluster import Cluster, cluster_at, local_cluster

LIMIT_S = 60.0


@pytest.fixture(scope="module")
def cluster() -> Iterator[Cluster]:
    with local_cluster(2, "auto") as cluster:
        yield cluster


def test_the_work_of_a_killed_worker_is_redone_and_no_other_is_lost(cluster: Cluster, tmp_path: Path) -> None:
    tasks = [StubTask(f"axis{n}", str(tmp_path), deaths=int(n == 3)) for n in range(8)]
    ended = list(cluster.run(fleet_stubs.run, tasks, LIMIT_S))
    assert sorted(one.value for one in ended) == sorted(task.name.upper() for task in tasks)
    assert len(list(tmp_path.glob("axis3-*"))) == 2
    assert not any(one.failure for one in ended)


def test_work_that_kills_every_worker_is_reported_and_the_other_work_done(
    cluster: Cluster, tmp_path: Path
) -> None:
    tasks = [StubTask("poison", str(tmp_path), deaths=99), StubTask("good", str(tmp_path))]
    ended = {one.task.name: one for one in cluster.run(fleet_stubs.run, tasks, LIMIT_S)}
    assert ended["good"].value == "GOOD"
    assert ended["poison"].failure == "killed"
    assert "3 workers died" in ended["poison"].reason
    assert len(list(tmp_path.glob("poison-*"))) == 3


def test_endless_work_is_stopped_and_its_worker_survives(cluster: Cluster) -> None:
    before = cluster.run_on_every_worker(os.getpid)
    (ended,) = cluster.run(fleet_stubs.never_end, [StubTask("slow")], 0.2)
    assert (ended.failure, ended.reason) == ("over time", "took longer than 0.2 s")
    assert before.items() <= cluster.run_on_every_worker(os.getpid).items()


def test_a_cluster_is_used_by_its_address_and_lives_on(cluster: Cluster, tmp_path: Path) -> None:
    with cluster_at(cluster.address) as other:
        (ended,) = other.run(fleet_stubs.run, [StubTask("far", str(tmp_path))], LIMIT_S)
    assert ended.value == "FAR"
    (failed,) = cluster.run(fleet_stubs.fail, [StubTask("near")], LIMIT_S)
    assert (failed.failure, failed.reason) == ("failed", "ValueError: near")


def test_the_cluster_listens_on_loopback_only(cluster: Cluster) -> None:
    assert cluster.address.startswith("tcp://127.0.0.1:")
    for listening in cluster.run_on_every_worker(fleet_stubs.listening).values():
        assert listening
        assert set(listening) == {"127.0.0.1"}
    assert set(fleet_stubs.listening()) <= {"127.0.0.1"}


def test_an_unreachable_address_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("reconcile.fleet.dask_workers.CONNECT_S", 0.3)
    nobody = cluster_at("tcp://127.0.0.1:9")
    with pytest.raises(ReconcileError, match=r"127\.0\.0\.1:9.*no scheduler answers"):
        nobody.__enter__()


def test_workers_that_cannot_run_the_work_are_named(cluster: Cluster) -> None:
    with pytest.raises(ReconcileError, match=r"worker tcp.*cannot run it.*install the same version"):
        cluster.run_on_every_worker(lambda: 1 // 0)


def test_a_worker_that_is_slow_is_not_said_to_be_of_another_version(
    cluster: Cluster, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("reconcile.fleet.cluster.BEGIN_S", 1e-6)
    with pytest.raises(
        ReconcileError, match=r"worker tcp.*not answered within 1e-06 s.*overloaded"
    ) as caught:
        cluster.run_on_every_worker(fleet_stubs.listening)
    assert "version" not in str(caught.value)
