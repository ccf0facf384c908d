"""A cancelled run leaves its drives at once; what the campaign exchanges is there again behind a run."""

from __future__ import annotations

import os
from random import Random
from typing import TYPE_CHECKING

import pytest

from tests.campaigns.campaign import faults, life, worker
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
    cut: list[tuple[int, float]] = []

    def cancel() -> None:
        stand.broker.fall_silent()
        cut.append((len(stand.wire.frames), stand.loop.time()))
        stand.kill()

    stand.loop.call_later(IN_MOTION_S, cancel)
    ending = life.live(stand, life.first(plan, stand))
    assert ending.error == "cancelled"
    ((place, time_s),) = cut
    behind = [frame for frame in stand.wire.frames[place:] if frame.sender == "controller"]
    assert {frame.data[1] for frame in behind if frame.can_id == NMT and frame.data[0] == 2} == NODES
    assert {frame.time_s for frame in behind} == {time_s}


@pytest.fixture
def injection(tmp_path: Path) -> Iterator[_Injection]:
    stand = Stand(worker.machine(), tmp_path, "lockstep")
    yield _Injection(draw(0), stand, Random(8))
    life.close(stand)


def test_functions_replaced_by_two_faults_are_restored_after_the_run(injection: _Injection) -> None:
    fsync = os.fsync
    for context in (injection.context, injection.other):
        faults.named("disk full while learning").inject(context)
    assert os.fsync is not fsync
    injection.undo()
    assert os.fsync is fsync


def test_fault_not_injected_during_the_run_is_not_injected_after_it(injection: _Injection) -> None:
    came: list[FaultContext] = []
    injection._plan = injection._plan._replace(fault=Fault("any", came.append))
    wire = injection._stand.wire
    injection.within_frames(3, 3)
    injection.undo()
    for _ in range(5):
        wire.from_nodes(0x181, bytes(8))
    assert len(wire.frames) == 5
    assert not came
    assert injection.happened is None
