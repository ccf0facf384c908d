"""A cancelled run stops its drives at once, and the campaign restores replaced functions after a run."""

from __future__ import annotations

import os
from random import Random
from typing import TYPE_CHECKING

import pytest

from tests.campaigns.campaign import daemon_run, faults, worker
from tests.campaigns.campaign.draw import draw
from tests.campaigns.campaign.fault_context import Fault, FaultContext
from tests.campaigns.campaign.run import _Injection
from tests.campaigns.campaign.stand import Stand
from tests.campaigns.campaign.wire import NMT

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

IN_MOTION_S = 0.6
NODES = {1, 2, 11, 12}


def test_drives_are_stopped_at_once_although_the_broker_does_not_disconnect(tmp_path: Path) -> None:
    stand = Stand(worker.machine(), tmp_path, "realtime")
    plan = draw(0)._replace(fault=faults.named("MQTT broker gone"), stand_by=False, pacing="realtime")
    instants: list[tuple[int, float]] = []

    def cancel() -> None:
        stand.broker.stop_responding()
        instants.append((len(stand.wire.frames), stand.loop.time()))
        stand.kill()

    stand.loop.call_later(IN_MOTION_S, cancel)
    ending = daemon_run.run_daemon(stand, daemon_run.faulty_run(plan, stand))
    assert ending.error == "cancelled"
    ((place, time_s),) = instants
    later = [frame for frame in stand.wire.frames[place:] if frame.sender == "controller"]
    assert {frame.data[1] for frame in later if frame.can_id == NMT and frame.data[0] == 2} == NODES
    assert {frame.time_s for frame in later} == {time_s}


@pytest.fixture
def injection(tmp_path: Path) -> Iterator[_Injection]:
    stand = Stand(worker.machine(), tmp_path, "lockstep")
    yield _Injection(draw(0), stand, Random(8))
    daemon_run.close_loop(stand)


def test_functions_replaced_by_two_faults_are_restored_after_the_run(injection: _Injection) -> None:
    fsync = os.fsync
    for context in (injection.context, injection.second_context):
        faults.named("disk full while learning").inject(context)
    assert os.fsync is not fsync
    injection.undo()
    assert os.fsync is fsync


def test_fault_not_injected_during_the_run_is_not_injected_after_it(injection: _Injection) -> None:
    calls: list[FaultContext] = []
    injection._plan = injection._plan._replace(fault=Fault("any", calls.append))
    wire = injection._stand.wire
    injection.inject_within_frames(3, 3)
    injection.undo()
    for _ in range(5):
        wire.from_nodes(0x181, bytes(8))
    assert len(wire.frames) == 5
    assert not calls
    assert injection.injected is None
