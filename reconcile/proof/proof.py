"""Prediction errors of the written and of a rigid model on recordings that took no part in them."""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

from reconcile.catalogue.kinds import ResidualChannel
from reconcile.proof.model_variants import AS_FOUND

LEAST_BETTER = 0.98
"""RMS error of a model over that of another, below which it counts as better; chosen."""


class LeftOut(NamedTuple):
    """Errors of two models on a recording that took no part in them, RMS, N or m."""

    source: str
    channel: ResidualChannel
    samples: int
    measured: float
    """The channel itself."""
    rigid: float
    """Mass, viscous and Coulomb friction, refitted on the others."""
    written: float
    """The model file that a diagnosis of the other recordings writes."""


class Proof(NamedTuple):
    """The errors on all that was left out of one axis in one channel."""

    channel: ResidualChannel
    parts: list[LeftOut]
    last_third: bool
    """There is one recording, and its last third was left out."""
    dropped: tuple[str, ...] = ()
    """Effects that the written model does without, because with them it predicted worse than a rigid one."""
    variant: str = AS_FOUND
    """Which of VARIANTS is written: the one that predicted best."""

    @property
    def rigid(self) -> float:
        """RMS over all parts, N or m."""
        return _pooled([(part.samples, part.rigid) for part in self.parts])

    @property
    def written(self) -> float:
        """RMS over all parts, N or m."""
        return _pooled([(part.samples, part.written) for part in self.parts])

    @property
    def improves(self) -> bool:
        """Whether the written model predicts what was left out better than the rigid one."""
        return self.written < LEAST_BETTER * self.rigid


def proof_json(proof: Proof) -> dict[str, Any]:
    """An entry of `proof` in verdict.json."""
    return {
        "channel": proof.channel.value,
        "unit": "N" if proof.channel is ResidualChannel.FORCE else "m",
        "left_out": "the last third" if proof.last_third else "each recording in turn",
        "rigid": proof.rigid,
        "written": proof.written,
        "improves": proof.improves,
        "dropped": list(proof.dropped),
        "written_model": proof.variant,
        "parts": [
            {"recording": one.source, "measured": one.measured, "rigid": one.rigid, "written": one.written}
            for one in proof.parts
        ],
    }


def _pooled(parts: Sequence[tuple[int, float]]) -> float:
    samples = sum(count for count, _ in parts)
    return math.sqrt(sum(count * rms**2 for count, rms in parts) / samples) if samples else 0.0
