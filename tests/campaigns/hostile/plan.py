"""Draws the attacks of the campaign."""

from random import Random

from tests.campaigns.hostile.attack import Attack
from tests.campaigns.hostile.frames import FAMILIES, NEVER_HARMLESS

STATES = ("standby", "starting", "ready", "running")


def plan_attacks(seed: int, count: int, frames: int) -> list[Attack]:
    """Return `count` attacks of `frames` frames each; families and states take turns, the rest is random."""
    rng, families = Random(seed), list(FAMILIES)

    def one(number: int) -> Attack:
        family = families[number % len(families)]
        state = STATES[(number + number // len(families)) % len(STATES)]
        return Attack(
            seed=rng.getrandbits(32),
            family=family,
            state=state,
            pacing="realtime" if rng.random() < 0.8 else "lockstep",
            stand_by=rng.random() < 0.9 or state == "standby",
            frames=frames,
            only_harmless=rng.random() < 0.3 and family not in NEVER_HARMLESS,
        )

    return [one(number) for number in range(count)]
