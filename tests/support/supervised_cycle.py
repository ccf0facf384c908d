"""One cycle under supervision, as the daemon sees it: the signs of the compiled tick, then the judgement."""

from servo_ctrl.axis import supervision
from servo_ctrl.axis.supervision import Counts
from servo_ctrl.control.signs import SupervisionLimits, signs


def supervise(
    limits: SupervisionLimits,
    counts: Counts,
    deviation_m: float,
    force_n: float,
    current_a: float,
    push_n: float,
    velocity_m_s: float,
    error_m: float,
) -> tuple[Counts, int]:
    """Counts and finding behind this cycle."""
    seen = signs(limits, deviation_m, force_n, current_a, push_n, error_m)
    return supervision.supervise(limits, counts, seen, push_n, velocity_m_s, error_m)
