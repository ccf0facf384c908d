"""Each oracle detects its violation: evidence of a run without violations, with one change."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from tests.campaigns.campaign import oracles_motion, oracles_reaction, oracles_results, spec, worker
from tests.campaigns.campaign.draw import draw
from tests.campaigns.campaign.oracles import judge
from tests.campaigns.campaign.oracles_reaction import OUR_EMCY, RPDO_IDS
from tests.campaigns.campaign.wire import CONTROLLER, Frame

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.campaigns.campaign.run import Evidence

ENABLED, RELEASED, EMCY = b"\x0f" + bytes(5), bytes(6), b"\x00\x10\x01" + bytes(5)


def harmless(evidence: Evidence) -> Evidence:
    """Return evidence of a fault that must have no consequence."""
    fault = evidence.plan.fault._replace(event=None)
    return evidence._replace(plan=evidence.plan._replace(fault=fault), frames=[], frames_before_stop=None)


def changed(evidence: Evidence, column: str, rows: Any, value: float) -> Evidence:
    """Return evidence with a changed column of the true motion."""
    values = getattr(evidence.truth, column).copy()
    values[rows] = value
    return evidence._replace(truth=evidence.truth._replace(**{column: values}))


def reframed(evidence: Evidence, change: Callable[[Frame], Frame | None]) -> Evidence:
    """Return evidence with changed frames after the fault."""
    assert evidence.injected is not None
    begin = evidence.injected.frame_index
    after_fault = [frame for frame in map(change, evidence.frames[begin:]) if frame is not None]
    return evidence._replace(frames=evidence.frames[:begin] + after_fault)


def verdict_of(oracle: Callable[[Evidence], list[str]], evidence: Evidence) -> str:
    return "; ".join(oracle(evidence))


def test_table_beyond_its_limit(evidence: Evidence) -> None:
    assert not oracles_motion.within_limits(evidence)
    assert "14.000 mm" in verdict_of(
        oracles_motion.within_limits, changed(evidence, "position_m", (50, 1), -0.014)
    )


def test_power_or_motion_in_the_end(evidence: Evidence) -> None:
    assert not oracles_motion.at_rest(evidence)
    assert "has power" in verdict_of(oracles_motion.at_rest, changed(evidence, "powered", (-1, 0), 1.0))
    assert "moves" in verdict_of(oracles_motion.at_rest, changed(evidence, "velocity_m_s", (-20, 1), 1e-3))


def test_drive_in_operation_in_standby(evidence: Evidence) -> None:
    begin = next(cycle for cycle, stage in evidence.stages if stage == oracles_motion.STANDBY and cycle > 50)
    rows = np.flatnonzero(evidence.truth.cycle == begin + 20)
    assert not oracles_motion.no_operation_in_standby(evidence)
    assert "in operation" in verdict_of(
        oracles_motion.no_operation_in_standby, changed(evidence, "enabled", (rows, 0), 1.0)
    )


def test_reaction_that_does_not_come(evidence: Evidence) -> None:
    def without_reaction(frame: Frame) -> Frame | None:
        if frame.can_id == OUR_EMCY:
            return None
        return frame._replace(data=ENABLED) if frame.can_id in RPDO_IDS else frame

    assert oracles_reaction.reaction(reframed(evidence, without_reaction))[1] == [
        "hold required, but the bus shows no reaction"
    ]


def test_reaction_that_comes_too_late(evidence: Evidence) -> None:
    def late(frame: Frame) -> Frame:
        return frame._replace(cycle=frame.cycle + 5) if frame.can_id == OUR_EMCY else frame

    seen, problems = oracles_reaction.reaction(reframed(evidence, late))
    assert seen is not None
    assert seen.cycles > seen.bound
    assert "allowed" in problems[0]


def test_request_to_drives_that_are_off_and_stay_so(evidence: Evidence) -> None:
    def silent(frame: Frame) -> Frame | None:
        return None if frame.can_id == OUR_EMCY else frame._replace(cycle=frame.cycle + 500)

    fault = evidence.plan.fault._replace(event="switched off", cause=None)
    asked = evidence._replace(plan=evidence.plan._replace(fault=fault))
    assert oracles_reaction.reaction(reframed(asked, silent))[1], "off too late"
    assert asked.injected is not None
    off = changed(asked, "powered", asked.truth.cycle >= asked.injected.cycle, 0.0)
    assert oracles_reaction.reaction(reframed(off, silent)) == (None, [])


def test_drive_that_goes_on_without_its_controller(evidence: Evidence) -> None:
    fault = evidence.plan.fault._replace(kills="controller")
    assert evidence.injected is not None
    cycle = evidence.injected.cycle
    orphan = evidence._replace(plan=evidence.plan._replace(fault=fault), killed_cycle=cycle)
    after_fault = orphan.truth.cycle >= cycle
    good = changed(orphan, "enabled", after_fault, 0.0)
    assert oracles_reaction.reaction(good)[1] == []
    late = np.flatnonzero(after_fault)[250]
    assert (
        "after its controller has gone"
        in oracles_reaction.reaction(changed(good, "enabled", (late, 1), 1.0))[1][0]
    )


def test_drives_not_commanded_in_the_same_cycle(evidence: Evidence) -> None:
    cycle = max(frame.cycle for frame in evidence.frames)

    def apart(frame: Frame) -> Frame:
        held = frame.can_id == RPDO_IDS[1] and frame.cycle < cycle - 20
        return frame._replace(data=ENABLED) if held else frame

    assert not oracles_motion.axes_stop_together(evidence)
    assert "not in one" in verdict_of(oracles_motion.axes_stop_together, reframed(evidence, apart))


def test_axes_that_do_not_come_to_rest_together(evidence: Evidence) -> None:
    assert evidence.injected is not None
    truth, cycle = evidence.truth, evidence.injected.cycle
    at = int(np.flatnonzero(truth.cycle >= cycle)[0])
    released = next(
        f.cycle
        for p, f, on in oracles_reaction.controlwords(evidence)
        if p > evidence.injected.frame_index and not on
    )
    last = int(np.flatnonzero(truth.cycle <= released)[-1])
    speeds = np.zeros_like(truth.velocity_m_s)
    speeds[at:last, 0] = 0.05
    speeds[at : at + 2, 1] = 0.05
    apart = evidence._replace(truth=truth._replace(velocity_m_s=speeds))
    assert last - at > 18, "otherwise the stop is too short"
    assert "ms apart" in verdict_of(oracles_motion.axes_stop_together, apart)


def test_harmless_fault_with_a_reaction(evidence: Evidence) -> None:
    good = harmless(evidence)
    assert good.injected is not None
    good = good._replace(injected=good.injected._replace(frame_index=0))
    frames = [Frame(0.0, 5, CONTROLLER, can_id, ENABLED, arrived=True) for can_id in RPDO_IDS]
    assert not oracles_reaction.no_reaction(good._replace(frames=frames))
    off = [*frames, Frame(0.0, 6, CONTROLLER, RPDO_IDS[0], RELEASED, arrived=True)]
    assert "switched off" in verdict_of(oracles_reaction.no_reaction, good._replace(frames=off))
    with_emcy = [*frames, Frame(0.0, 6, CONTROLLER, OUR_EMCY, EMCY, arrived=True)]
    assert "reports an error" in verdict_of(oracles_reaction.no_reaction, good._replace(frames=with_emcy))


@pytest.mark.parametrize(
    "bad", [{"stuck": "here"}, {"error": "ValueError: x"}, {"error": "refused: x"}, {"error": "cancelled"}]
)
def test_run_that_does_not_end_as_it_should(evidence: Evidence, bad: dict[str, str]) -> None:
    assert not oracles_results.ended_as_intended(evidence)
    assert oracles_results.ended_as_intended(evidence._replace(**bad))


def test_event_that_is_not_reported(evidence: Evidence) -> None:
    assert not oracles_results.reported(evidence)
    assert evidence.report is not None
    learning = evidence.report.learning._replace(reason="")
    silent = dataclasses.replace(evidence.report, events=(), reason="", learning=learning)
    assert "not reported" in verdict_of(oracles_results.reported, evidence._replace(report=silent))


def test_emergency_message_of_a_node_that_is_not_reported(evidence: Evidence) -> None:
    frame = Frame(0.3, 100, "nodes", 0x08C, b"\x34\x12\x01" + bytes(5), arrived=True)
    more = evidence._replace(frames=[*evidence.frames, frame])
    assert "1234h of node 12" in verdict_of(oracles_results.reported, more)


def test_learned_result_that_is_damaged_or_missing(evidence: Evidence) -> None:
    machine = worker.machine().controller
    assert not oracles_results.learned(evidence, machine)
    version = evidence.folder / "learned" / "x" / "v0002.json"
    text = version.read_text(encoding="utf-8")
    version.write_text(text[: len(text) // 2], encoding="utf-8")
    assert any("v0002.json" in problem for problem in oracles_results.learned(evidence, machine))
    (evidence.folder / "learned" / "y" / "active.json").unlink()
    assert "learned: nothing of axis y is in use any more" in oracles_results.learned(evidence, machine)


def test_good_run_has_no_findings(evidence: Evidence) -> None:
    assert judge(evidence, worker.machine().controller).violations == ()


def test_page_of_the_fault_policy_is_read(evidence: Evidence) -> None:
    assert spec.reactions()["inputs missing"]["running"] == "quick stop"
    assert spec.reactions()["stop signal"]["standby"] == "disable"
    bounds = spec.bounds(lockstep=False)
    assert bounds["heartbeat missing"].detection == 5 * spec.HEARTBEAT_CYCLES
    assert bounds["inputs missing"].detection > spec.bounds(lockstep=True)["inputs missing"].detection
    assert set(bounds) == set(spec.reactions())


def test_every_fault_has_a_row_of_the_page_or_none() -> None:
    events = {event for seed in range(3000) for event in (draw(seed).fault.event, *draw(seed).fault.also)}
    assert events - {None} <= set(spec.reactions())
