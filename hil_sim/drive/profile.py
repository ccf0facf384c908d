"""Trapezoidal velocity profile from any state of motion to standstill at a target.

Units: counts, counts/s, counts/s^2. With S the distance in the direction of travel, the peak velocity of
"accelerate from v0 at a, decelerate at d" is vp = sqrt((2 a d S + d v0^2) / (a + d)).
"""

import math
from typing import NamedTuple


class Phase(NamedTuple):
    """Constant acceleration (counts/s^2) for a time."""

    duration_s: float
    acceleration: float


class Profile(NamedTuple):
    """Motion from (position, velocity) to standstill at `target`."""

    position: float
    velocity: float
    target: float
    phases: tuple[Phase, ...]

    @property
    def duration_s(self) -> float:
        """Time from start to standstill."""
        return sum(phase.duration_s for phase in self.phases)

    def at(self, time_s: float) -> tuple[float, float]:
        """Return position and velocity at a time since the start; exactly the target after the end."""
        if time_s >= self.duration_s:
            return self.target, 0.0
        position, velocity = self.position, self.velocity
        for duration_s, acceleration in self.phases:
            step_s = min(duration_s, time_s)
            position += (velocity + 0.5 * acceleration * step_s) * step_s
            velocity += acceleration * step_s
            time_s -= step_s
            if time_s <= 0.0:
                break
        return position, velocity


def plan(
    position: float, velocity: float, target: float, speed: float, acceleration: float, deceleration: float
) -> Profile:
    """Plan the fastest motion to standstill at `target` within `speed`; both accelerations are > 0.

    A start above `speed` decelerates to it. A start too fast to stop at the target overruns it and returns.
    With speed 0 the motion ends after braking, not at the target.
    """
    phases: list[Phase] = []
    here, now = position, velocity
    stop = here + now * abs(now) / (2.0 * deceleration)
    direction = math.copysign(1.0, target - stop)
    if now * direction < 0.0 or speed <= 0.0:  # moving away: stop first
        phases.append(Phase(abs(now) / deceleration, -math.copysign(deceleration, now)))
        here, now = stop, 0.0
    if speed <= 0.0:
        return Profile(position, velocity, here, tuple(phases))
    along = now * direction
    if along > speed:
        brake_s = (along - speed) / deceleration
        phases.append(Phase(brake_s, -direction * deceleration))
        here += direction * 0.5 * (along + speed) * brake_s
        along = speed
    distance = max(0.0, (target - here) * direction)
    peak = math.sqrt(
        (2.0 * acceleration * deceleration * distance + deceleration * along * along)
        / (acceleration + deceleration)
    )
    peak = max(along, min(peak, speed))
    ramps = (peak * peak - along * along) / (2.0 * acceleration) + peak * peak / (2.0 * deceleration)
    phases.append(Phase((peak - along) / acceleration, direction * acceleration))
    if peak > 0.0:
        phases.append(Phase(max(0.0, distance - ramps) / peak, 0.0))
    phases.append(Phase(peak / deceleration, -direction * deceleration))
    return Profile(position, velocity, target, tuple(phases))
