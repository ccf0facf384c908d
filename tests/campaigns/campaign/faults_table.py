"""Faults of the table and its drives: those of `hil_sim.faults`, befalling one axis at the chosen instant."""

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
    DRIFTED,
    cannot_follow,
    coupling_slips,
    runs_away,
    scale_stands,
    stays_away,
)
from tests.campaigns.campaign.fault_context import MOVING, POWERED, WIRED, Fault, FaultContext

if TYPE_CHECKING:
    from collections.abc import Callable

LED = ("ready", *MOVING)
DRIVEN = ("running", "jogging", "learning")
PUSHED_S = 0.15


def befall(module: Any, draw: Callable[[FaultContext], Any] | None = None) -> Callable[[FaultContext], None]:
    """Let a fault of the simulator begin on the axis of the context."""

    def inject(context: FaultContext) -> None:
        stand = context.stand
        target = stand.bench.fault_targets["xy"[context.axis]]
        params = module.Params() if draw is None else draw(context)
        context.wire.then(lambda: module.begin(target, params))
        if hasattr(module, "end"):
            stand.loop.call_later(params.duration_s, lambda: module.end(target, params))

    return inject


def knocked(context: FaultContext) -> None:
    """Something runs into the table: motor and table have another speed from one moment to the next."""
    _knock(context, context.rng.choice((-1.0, 1.0)))


def knocked_outwards(context: FaultContext) -> None:
    """The same, towards the limit that the axis is at."""
    index = context.axis
    witness = context.stand.witness
    position_m = context.stand.bench.plant.state["table_position_m"][index] - witness.start_m[index]
    _knock(context, 1.0 if position_m > 0.0 else -1.0)


def _knock(context: FaultContext, side: float) -> None:
    speed_m_s = side * context.rng.uniform(0.12, 0.25)
    state = context.stand.bench.plant.state[context.axis]

    def change() -> None:
        for field in ("table_velocity_m_s", "motor_velocity_m_s"):
            state[field] += speed_m_s

    context.wire.then(change)


def pushed(context: FaultContext) -> None:
    """Somebody pushes the table by hand while no drive has power, on beyond its limits perhaps."""
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
        ("following error", "at its limit", "runs away"),
        states=LED,
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
        befall(limit_switch, lambda context: limit_switch.Params(context.rng.choice((-1.0, 1.0)))),
        "limit switch",
        ("limit switch",),
        states=POWERED,
        physical=True,
        seen_cycles=spec.UNITS["limit_switch_syncs"] + 1,
        while_led=True,
    ),
    Fault(
        "broken scale",
        befall(broken_scale),
        DRIFTED,
        ("scale",),
        states=LED,
        physical=True,
        cause=scale_stands,
    ),
    Fault(
        "slipped coupling",
        befall(slipped_coupling),
        DRIFTED,
        ("scale", "following error"),
        states=LED,
        physical=True,
        coasts=True,
        cause=coupling_slips,
    ),
    Fault(
        "axis runs away",
        befall(runaway_sign),
        "axis runs away",
        ("runs away", "following error", "at its limit"),
        states=DRIVEN,
        physical=True,
        coasts=True,
        cause=runs_away,
    ),
    Fault(
        "jammed axis",
        befall(jammed_axis),
        "current saturated",
        ("following error", "at its limit", "runs away"),  # as a spring it may throw the axis back
        states=DRIVEN,
        physical=True,
        cause=cannot_follow,
    ),
    Fault(
        "brown-out of a drive",
        befall(brownout),
        "emergency message",
        ("EMCY 3220h",),
        states=POWERED,
        physical=True,
        also=("drive fault",),
    ),
    Fault(
        "death of a node",
        befall(node_death, lambda context: node_death.Params(context.rng.choice((0.0, 1.0)))),
        "inputs missing",
        ("cyclic inputs do not come",),
        states=WIRED,
        physical=True,
        coasts=True,
        blind_s=0.025,
        seen_cycles=24,
    ),
    Fault(
        "mute node",
        befall(mute_node, lambda context: mute_node.Params(context.rng.uniform(0.05, 0.2))),
        "inputs missing",
        ("cyclic inputs do not come",),
        states=WIRED,
        physical=True,
        blind_s=0.025,
        seen_cycles=24,
        distorts=True,
        cause=stays_away,
    ),
)
