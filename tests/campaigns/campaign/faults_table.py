"""Faults of the table and its drives: those of `hil_sim.faults` on one axis, knocks and pushes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from hil_sim.faults import (
    broken_scale,
    brownout,
    jammed_axis,
    limit_switch,
    mute_node,
    node_death,
    runaway_sign,
    slipped_coupling,
)
from tests.campaigns.campaign import spec
from tests.campaigns.campaign.causes import (
    SENSORS_DISAGREE,
    cannot_follow,
    coupling_slipped,
    inputs_stay_missing,
    runs_away,
    scale_frozen,
)
from tests.campaigns.campaign.fault_context import MOVING, POWERED, WIRED, Fault, FaultContext

if TYPE_CHECKING:
    from collections.abc import Callable

CONTROLLED = ("ready", *MOVING)
DRIVEN = ("running", "jogging", "learning")
PUSHED_S = 0.15


def simulator_fault(
    module: Any, draw: Callable[[FaultContext], Any] | None = None
) -> Callable[[FaultContext], None]:
    """Return a fault that begins a fault of the simulator on the axis of the context."""

    def inject(context: FaultContext) -> None:
        stand = context.stand
        target = stand.bench.fault_targets["xy"[context.axis]]
        params = module.Params() if draw is None else draw(context)
        context.wire.after_frame(lambda: module.begin(target, params))
        if hasattr(module, "end"):
            stand.loop.call_later(params.duration_s, lambda: module.end(target, params))

    return inject


def knocked(context: FaultContext) -> None:
    """An impact: the speed of motor and table changes in one step."""
    _knock(context, context.rng.choice((-1.0, 1.0)))


def knocked_outwards(context: FaultContext) -> None:
    """An impact towards the limit at which the axis stands."""
    index = context.axis
    truth_recorder = context.stand.truth_recorder
    position_m = context.stand.bench.plant.state["table_position_m"][index] - truth_recorder.start_m[index]
    _knock(context, 1.0 if position_m > 0.0 else -1.0)


def _knock(context: FaultContext, direction: float) -> None:
    speed_m_s = direction * context.rng.uniform(0.12, 0.25)
    state = context.stand.bench.plant.state[context.axis]

    def change_speed() -> None:
        for field in ("table_velocity_m_s", "motor_velocity_m_s"):
            state[field] += speed_m_s

    context.wire.after_frame(change_speed)


def pushed(context: FaultContext) -> None:
    """The table is pushed by hand while no drive has power, possibly beyond its limits."""
    loop, state = context.stand.loop, context.stand.bench.plant.state[context.axis]
    speed_m_s = context.rng.choice((-1.0, 1.0)) * context.rng.uniform(0.02, 0.06)
    until_s = loop.time() + context.rng.uniform(0.01, PUSHED_S)

    def push() -> None:
        if loop.time() > until_s:
            return
        for field in ("table_velocity_m_s", "motor_velocity_m_s"):
            state[field] = speed_m_s
        loop.call_later(1e-3, push)

    push()


FAULTS = (
    Fault(
        "axis knocked",
        knocked,
        "following error",
        ("following error", "force saturated", "runs away"),
        states=CONTROLLED,
        physical=True,
        cause=cannot_follow,
        knocks=True,
    ),
    Fault(
        "axis knocked beyond its limit",
        knocked_outwards,
        "position limit",
        ("beyond limits.position_mm", "following error"),
        states=("at a limit",),
        physical=True,
        cause=cannot_follow,
        knocks=True,
    ),
    Fault(
        "table pushed in standby",
        pushed,
        states=("standby",) * 3,
        physical=True,
        coasts=True,
        blind_s=PUSHED_S,
    ),
    Fault(
        "limit switch",
        simulator_fault(limit_switch, lambda context: limit_switch.Params(context.rng.choice((-1.0, 1.0)))),
        "limit switch",
        ("limit switch",),
        states=POWERED,
        physical=True,
        reported_within_cycles=spec.UNITS["limit_switch_syncs"] + 1,
        while_controlled=True,
    ),
    Fault(
        "broken scale",
        simulator_fault(broken_scale),
        SENSORS_DISAGREE,
        ("scale",),
        states=CONTROLLED,
        physical=True,
        cause=scale_frozen,
    ),
    Fault(
        "slipped coupling",
        simulator_fault(slipped_coupling),
        SENSORS_DISAGREE,
        ("scale", "following error"),
        states=CONTROLLED,
        physical=True,
        coasts=True,
        cause=coupling_slipped,
    ),
    Fault(
        "axis runs away",
        simulator_fault(runaway_sign),
        "axis runs away",
        ("runs away", "following error", "force saturated"),
        states=DRIVEN,
        physical=True,
        coasts=True,
        cause=runs_away,
    ),
    Fault(
        "jammed axis",
        simulator_fault(jammed_axis),
        "current saturated",
        # the jam yields like a spring and may push the axis back
        ("following error", "force saturated", "runs away"),
        states=DRIVEN,
        physical=True,
        cause=cannot_follow,
    ),
    Fault(
        "brown-out of a drive",
        simulator_fault(brownout),
        "emergency message",
        ("EMCY 3220h",),
        states=POWERED,
        physical=True,
        also=("drive fault",),
    ),
    Fault(
        "death of a node",
        simulator_fault(node_death, lambda context: node_death.Params(context.rng.choice((0.0, 1.0)))),
        "inputs missing",
        ("TPDOs are no longer received",),
        states=WIRED,
        physical=True,
        coasts=True,
        blind_s=0.025,
        reported_within_cycles=24,
    ),
    Fault(
        "mute node",
        simulator_fault(mute_node, lambda context: mute_node.Params(context.rng.uniform(0.05, 0.2))),
        "inputs missing",
        ("TPDOs are no longer received",),
        states=WIRED,
        physical=True,
        blind_s=0.025,
        reported_within_cycles=24,
        changes_frames=True,
        cause=inputs_stay_missing,
    ),
)
