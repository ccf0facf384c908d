"""Checks that an attack caused no crash, no hang, and no motion without a command."""

from typing import NamedTuple

import numpy as np

from servo_ctrl.commands.stage import Stage
from tests.campaigns.campaign.machine import LIMIT_MM
from tests.campaigns.hostile.attack import Outcome
from tests.campaigns.hostile.frames import OBEYED

STILL_M = 1e-9
"""Largest motion of an axis at standstill: rounding."""
WITHOUT_POWER = {Stage.STANDBY, Stage.DISABLING, Stage.OFF}
REACTION_CYCLES = 2
"""Most cycles from a forged frame to the stop."""
FOLLOWING_ERROR_MM, ACCELERATION_MM_S2, FASTEST_MM_S = 1.0, 2000.0, 200.0
OVERSHOOT_MM = FOLLOWING_ERROR_MM + FASTEST_MM_S**2 / (2.0 * ACCELERATION_MM_S2)
"""Largest distance beyond the limits: following error and braking distance."""


class Verdict(NamedTuple):
    """Violations of an attack, and figures for the tables."""

    problems: tuple[str, ...]
    moved_mm: float
    """Largest displacement of an axis since the attack began."""
    unpowered: bool
    """The daemon did not power the axes after the attack began."""
    reaction_cycles: int | None
    """Cycles from the first frame that only a controller may send to the stop."""


def judge(outcome: Outcome) -> Verdict:
    """Run all checks of one attack."""
    attack = outcome.attack
    problems = [text for text in (outcome.error, outcome.stuck) if text]
    if outcome.first_row is None:
        problems.append(f"the state {attack.state} was not reached")
    if outcome.sent != attack.frames:
        problems.append(f"{outcome.sent} of {attack.frames} frames were sent")
    if outcome.report is None:
        problems.append("the run has no report")
    truth, first_row = outcome.truth, outcome.first_row or 0
    after_mm = 1e3 * truth.position_m[first_row:]
    if not (np.isfinite(after_mm).all() and np.isfinite(truth.velocity_m_s).all()):
        problems.append("the plant is not a number")
    moved_mm = float(np.abs(after_mm - after_mm[0]).max()) if len(after_mm) else 0.0
    stages = _stages_after(outcome)
    unpowered = stages <= WITHOUT_POWER
    obeyed = attack.family in OBEYED and not attack.only_harmless
    if unpowered and not obeyed and moved_mm > 1e3 * STILL_M:
        problems.append(f"moved {moved_mm:g} mm without power")
    if not obeyed and len(after_mm) and float(np.abs(after_mm).max()) > LIMIT_MM + OVERSHOOT_MM:
        problems.append(f"went to {np.abs(after_mm).max():g} mm")
    reaction = _reaction(outcome)
    if reaction is not None and reaction > REACTION_CYCLES:
        problems.append(f"another controller was reacted to after {reaction} cycles")
    return Verdict(tuple(problems), moved_mm, unpowered, reaction)


def _stages_after(outcome: Outcome) -> set[int]:
    """Return the daemon's stages since the attack began."""
    if outcome.first_row is None:
        return set()
    cycle = int(outcome.truth.cycle[min(outcome.first_row, len(outcome.truth.cycle) - 1)])
    before = [stage for at, stage in outcome.stages if at <= cycle]
    return {*before[-1:], *(stage for at, stage in outcome.stages if at > cycle)}


def _reaction(outcome: Outcome) -> int | None:
    """Return the cycles until no axis follows set points; None if none did."""
    forged = outcome.first_forged
    if forged is None:
        return None
    live = {Stage.STARTING, Stage.READY, Stage.RUNNING}
    now = [stage for at, stage in outcome.stages if at <= forged]
    if not now or now[-1] not in live:
        return None
    left = [at for at, stage in outcome.stages if at > forged and stage not in live]
    return left[0] - forged if left else len(outcome.truth.cycle)
