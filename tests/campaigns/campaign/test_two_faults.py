"""Runs with a second fault or a following run, and the cycles from which causes are detectable."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from servo_ctrl.recording.reader import load_recording
from tests.campaigns.campaign import faults, oracles_reaction, worker
from tests.campaigns.campaign.causes import (
    DEVIATION_M,
    TPDO,
    cannot_follow,
    coupling_slipped,
    inputs_stay_missing,
    runs_away,
)
from tests.campaigns.campaign.draw import draw
from tests.campaigns.campaign.fault_context import DRIVES
from tests.campaigns.campaign.oracles import judge
from tests.campaigns.campaign.oracles_reaction import OUR_EMCY, RPDO_IDS
from tests.campaigns.campaign.run import SecondFault
from tests.campaigns.campaign.stand import Stand
from tests.campaigns.campaign.views import views

if TYPE_CHECKING:
    from tests.campaigns.campaign.run import Evidence
    from tests.campaigns.campaign.wire import Frame

DUE, SATURATED = 3, 60
ENABLED = b"\x0f" + bytes(5)


def with_tracking_error(evidence: Evidence, error_m: float, current: int) -> Evidence:
    """Return evidence with this error (m) from the fault on, and this current (per mille)."""
    assert evidence.injected is not None
    axis, since = evidence.axis, evidence.injected.cycle
    command_m = load_recording(evidence.folder / "recording").columns[f"{'xy'[axis]}.position_command_m"]
    truth = evidence.truth
    position_m = truth.position_m.copy()
    rows = np.flatnonzero((truth.cycle >= since) & (truth.cycle < len(command_m)))
    position_m[rows, axis] = command_m[truth.cycle[rows].astype(int)] - error_m

    def loaded(frame: Frame) -> Frame:
        if frame.can_id != TPDO + DRIVES[axis] or frame.cycle < since:
            return frame
        return frame._replace(data=frame.data[:6] + current.to_bytes(2, "little", signed=True))

    frames = [loaded(frame) for frame in evidence.frames]
    plan = evidence.plan._replace(fault=faults.named("jammed axis"))
    return evidence._replace(plan=plan, frames=frames, truth=truth._replace(position_m=position_m))


def with_late_report(evidence: Evidence, cycles: int) -> Evidence:
    """Return evidence in which the controller reports the fault this number of cycles later."""

    def late(frame: Frame) -> Frame:
        if frame.can_id == OUR_EMCY and evidence.injected and frame.cycle >= evidence.injected.cycle:
            return frame._replace(cycle=frame.cycle + cycles)
        return frame

    return evidence._replace(frames=[late(frame) for frame in evidence.frames])


def without_reaction(evidence: Evidence) -> Evidence:
    """Return evidence without a reaction on the bus after the fault."""
    assert evidence.injected is not None
    begun = evidence.injected.frame_index
    kept = [frame for place, frame in enumerate(evidence.frames) if place < begun or frame.can_id != OUR_EMCY]
    frames = [f._replace(data=ENABLED) if f.can_id in RPDO_IDS and f.cycle > 40 else f for f in kept]
    return evidence._replace(frames=frames)


def test_axis_that_does_not_follow_is_to_be_answered_at_once(evidence: Evidence) -> None:
    assert cannot_follow(with_tracking_error(evidence, 0.5e-3, 0)) == []
    assert evidence.injected is not None
    far = with_tracking_error(evidence, 1.5e-3, 0)
    assert cannot_follow(far)[0] == (evidence.injected.cycle, "following error")
    assert oracles_reaction.reaction(far)[1] == []
    problems = oracles_reaction.reaction(with_late_report(far, 10))[1]
    assert f"{DUE} allowed" in problems[0]


def test_current_at_its_limit_is_to_be_answered_in_time(evidence: Evidence) -> None:
    assert evidence.injected is not None
    cycle = evidence.injected.cycle
    found = cannot_follow(with_tracking_error(evidence, 0.0, 1490))
    assert all(cause.cycle > cycle + SATURATED for cause in found), "the ramp is over before that"
    since = evidence.injected._replace(cycle=cycle - 2 * SATURATED)
    earlier = with_tracking_error(evidence._replace(injected=since), 0.0, 1490)
    causes = cannot_follow(earlier._replace(injected=since._replace(frame_index=0)))
    assert causes == [(since.cycle, "current saturated")]


def test_runaway_is_judged_by_the_true_motion(evidence: Evidence) -> None:
    assert evidence.injected is not None
    slow = with_tracking_error(evidence, 0.0, 700)
    assert not runs_away(slow)
    axis, since = evidence.axis, evidence.injected.cycle
    rows = np.flatnonzero(slow.truth.cycle >= since)
    away = np.arange(len(rows)) * 2e-3
    position_m, velocity_m_s = slow.truth.position_m.copy(), slow.truth.velocity_m_s.copy()
    position_m[rows, axis] -= np.cumsum(away) * 1e-2
    velocity_m_s[rows, axis] = -away
    truth = slow.truth._replace(position_m=position_m, velocity_m_s=velocity_m_s)
    found = {cause.event: cause.cycle for cause in runs_away(slow._replace(truth=truth))}
    assert since < found["axis runs away"] < since + 12


def test_drive_that_continues_without_a_bus_is_detected(evidence: Evidence) -> None:
    assert evidence.injected is not None
    plan = evidence.plan._replace(fault=faults.named("interface fails"))
    enabled = evidence.truth.enabled.copy()
    after_fault = np.flatnonzero(evidence.truth.cycle >= evidence.injected.cycle)
    enabled[after_fault] = 0.0
    good = evidence._replace(plan=plan, truth=evidence.truth._replace(enabled=enabled))
    assert oracles_reaction.reaction(good)[1] == []
    enabled = enabled.copy()
    enabled[after_fault[250], 1] = 1.0
    bad = good._replace(truth=evidence.truth._replace(enabled=enabled))
    assert "after its controller has gone" in oracles_reaction.reaction(bad)[1][0]


def test_unanswered_second_fault_is_detected(evidence: Evidence) -> None:
    assert evidence.injected is not None
    plan = evidence.plan._replace(fault=faults.named("bus warning"), second=faults.named("emergency message"))
    second = SecondFault(evidence.injected, 1 - evidence.axis, evidence.node, {})
    two = evidence._replace(plan=plan, second=second)
    machine = worker.machine().controller
    assert not [text for text in judge(two, machine).violations if "second fault" in text]
    found = judge(without_reaction(two), machine).violations
    assert "second fault: hold required, but the bus shows no reaction" in found


def test_failure_of_the_following_run_is_detected(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nodes without repair: a cable that stays cut."""
    seed = next(
        seed
        for seed in range(20_000)
        if draw(seed).next_run and draw(seed).fault.name == "inputs missing" and draw(seed).second is None
    )
    assert worker.result(seed).violations == ()
    begin_next_run = Stand.begin_next_run

    def keep_cable_cut(stand: Stand) -> None:
        cut = stand.wire.inbound
        begin_next_run(stand)
        stand.wire.inbound = cut

    monkeypatch.setattr(Stand, "begin_next_run", keep_cable_cut)
    assert any("next_run_succeeds" in text for text in worker.result(seed).violations)


def test_two_faults_together_are_answered() -> None:
    seeds = [seed for seed in range(2000) if draw(seed).second is not None and draw(seed).state == "jogging"]
    for seed in seeds[:2]:
        assert worker.result(seed).violations == ()


def test_the_report_of_two_faults_of_one_axis_may_name_either(evidence: Evidence) -> None:
    assert evidence.injected is not None
    plan = evidence.plan._replace(fault=faults.named("axis knocked"), second=faults.named("broken scale"))
    for axis, both in ((evidence.axis, True), (1 - evidence.axis, False)):
        seen = views(
            evidence._replace(plan=plan, second=SecondFault(evidence.injected, axis, evidence.node, {}))
        )
        assert seen.first is not None
        assert (set(plan.second.words) <= set(seen.first.plan.fault.words)) is both


@pytest.mark.parametrize(
    ("pause", "same_axis", "shows_first"), [(0, True, False), (2, True, True), (0, False, True)]
)
def test_fault_of_a_node_that_died_before_reporting_it_is_not_required(
    evidence: Evidence, pause: int, same_axis: bool, shows_first: bool
) -> None:
    assert evidence.injected is not None
    dies = SecondFault(
        evidence.injected._replace(cycle=evidence.injected.cycle + pause),
        evidence.axis if same_axis else 1 - evidence.axis,
        evidence.node,
        {},
    )
    plan = evidence.plan._replace(second=faults.named("death of a node"))
    assert (views(evidence._replace(plan=plan, second=dies)).first is not None) is shows_first


@pytest.mark.parametrize("sent_between", [False, True])
def test_fault_of_a_node_that_restarts_is_required_where_it_has_sent_inputs_before(
    evidence: Evidence, sent_between: bool
) -> None:
    """A duplicate repeats the inputs of its node: without them it is not detectable."""
    assert evidence.injected is not None
    place = evidence.injected.frame_index
    tpdo_id = TPDO + evidence.node
    following = next(at for at, f in enumerate(evidence.frames[place:], place) if f.can_id == tpdo_id)
    until = following + 1 if sent_between else following
    restarts = SecondFault(evidence.injected._replace(frame_index=until), evidence.axis, evidence.node, {})
    plan = evidence.plan._replace(fault=faults.named("duplicate node"), second=faults.named("node restarts"))
    assert (views(evidence._replace(plan=plan, second=restarts)).first is not None) is sent_between


def test_delayed_inputs_are_allowed_for_in_the_deviation_of_scale_and_encoder(evidence: Evidence) -> None:
    """The deviation exceeds its bound by half; at 1 m/s the travel of a cycle is twice as much."""
    assert evidence.injected is not None
    truth, axis, since = evidence.truth, evidence.axis, evidence.injected.cycle
    motor_m, velocity_m_s = truth.motor_m.copy(), truth.velocity_m_s.copy()
    after_fault = truth.cycle > since
    motor_m[after_fault, axis] = truth.position_m[after_fault, axis] + 1.5 * DEVIATION_M
    velocity_m_s[:, axis] = 1.0
    slipped = evidence._replace(truth=truth._replace(motor_m=motor_m, velocity_m_s=velocity_m_s))
    (cause,) = coupling_slipped(slipped)
    assert cause.cycle == since + 1
    kept = [
        frame._replace(arrived=frame.can_id != TPDO + DRIVES[axis] or frame.cycle != since - 1)
        for frame in evidence.frames
    ]
    assert coupling_slipped(slipped._replace(frames=kept)) == []


def test_drive_counts_as_lost_after_more_missed_syncs_than_tolerated(evidence: Evidence) -> None:
    assert evidence.injected is not None
    since, tpdo_id = evidence.injected.cycle, TPDO + DRIVES[evidence.axis]

    def without(cycles: int) -> Evidence:
        gone = range(since, since + cycles)
        kept = [f for f in evidence.frames if f.can_id != tpdo_id or f.cycle not in gone]
        return evidence._replace(plan=evidence.plan._replace(pacing="realtime"), frames=kept)

    assert inputs_stay_missing(without(20)) == []
    assert [cause.cycle for cause in inputs_stay_missing(without(21))] == [since]
