"""Faults of the table and its drives: those of `hil_sim.faults`, befalling one axis at the chosen instant."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

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
from tests.campaign.faults_bus import WIRED
from tests.campaign.scene import MOVING, POWERED, Fault, Scene

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.campaign.run import Evidence

DEVIATION_M = 0.5e-3
"""limits.scale_deviation_mm, where it is not given: half of following_error_mm."""
LED = ("ready", *MOVING)
DRIVEN = ("running", "jogging", "learning")


def befall(module: Any, draw: Callable[[Scene], Any] | None = None) -> Callable[[Scene], None]:
    """Let a fault of the simulator begin on the axis of the scene."""

    def inject(scene: Scene) -> None:
        stand = scene.stand
        struck = stand.bench._struck(stand.machine.plant)["xy"[scene.axis]]
        params = module.Params() if draw is None else draw(scene)
        scene.wire.then(lambda: module.begin(struck, params))
        if hasattr(module, "end"):
            stand.loop.call_later(params.duration_s, lambda: module.end(struck, params))

    return inject


def scale_stands(evidence: Evidence) -> int | None:
    """Cycle in which the table is farther from where its scale stopped than the two may differ."""
    return _crossing(evidence, lambda here: evidence.truth.position_m[here, evidence.axis])


def coupling_slips(evidence: Evidence) -> int | None:
    """Cycle in which motor and table are farther apart than the two may differ."""
    truth, axis = evidence.truth, evidence.axis
    return _crossing(evidence, lambda here: truth.motor_m[here, axis] - truth.position_m[here, axis])


def _crossing(evidence: Evidence, value: Callable[[Any], Any]) -> int | None:
    """The first cycle behind the fault in which a value has gone farther than it may."""
    assert evidence.happened is not None
    here = evidence.truth.cycle >= evidence.happened[1]
    values = value(here)
    beyond = np.flatnonzero(np.abs(values - values[0]) > DEVIATION_M) if len(values) else values
    return int(evidence.truth.cycle[here][beyond[0]]) if len(beyond) else None


FAULTS = (
    Fault(
        "limit switch",
        befall(limit_switch, lambda scene: limit_switch.Params(scene.rng.choice((-1.0, 1.0)))),
        "limit switch",
        ("limit switch",),
        states=POWERED,
        physical=True,
    ),
    Fault(
        "broken scale",
        befall(broken_scale),
        "scale and encoder disagree",
        ("scale",),
        states=LED,
        physical=True,
        cause=scale_stands,
        also=("following error", "axis runs away"),
    ),
    Fault(
        "slipped coupling",
        befall(slipped_coupling),
        "scale and encoder disagree",
        ("scale", "following error"),
        states=LED,
        physical=True,
        coasts=True,
        cause=coupling_slips,
        also=("following error", "axis runs away"),
    ),
    Fault(
        "axis runs away",
        befall(runaway_sign),
        "axis runs away",
        ("runs away", "following error", "saturated"),
        states=DRIVEN,
        physical=True,
        coasts=True,
        needs_motion=True,
        slack_cycles=60,
        seen_cycles=100,
        also=("following error", "current saturated"),
    ),
    Fault(
        "jammed axis",
        befall(jammed_axis),
        "current saturated",
        ("following error", "saturated", "at its limit", "at their limit"),
        states=DRIVEN,
        physical=True,
        needs_motion=True,
        slack_cycles=120,
        seen_cycles=250,
        also=("following error",),
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
        befall(node_death, lambda scene: node_death.Params(scene.rng.choice((0.0, 1.0)))),
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
        befall(mute_node, lambda scene: mute_node.Params(scene.rng.uniform(0.05, 0.2))),
        "inputs missing",
        ("cyclic inputs do not come",),
        states=WIRED,
        physical=True,
        blind_s=0.025,
        seen_cycles=24,
        distorts=True,
    ),
)
