"""Prediction errors of the written and of a rigid model on recordings that took no part in them."""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from reconcile.catalogue.kinds import ResidualChannel
from reconcile.proof.model_variants import AS_FOUND

BETTER_RMS_RATIO = 0.98
"""RMS error of a model over that of another, below which it counts as better; chosen."""
LEAST_RMS = 1e-300
"""Least RMS error in a ratio, N or m."""
ROUNDING = 1e-9
"""Relative difference from a standard error that is none: two parts of which one is predicted alike."""


class HeldOutErrors(NamedTuple):
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
    parts: list[HeldOutErrors]
    is_last_third: bool
    """There is one recording, and its last third was left out."""
    dropped: tuple[str, ...] = ()
    """Effects that the written model does without, because with them it predicted worse than a rigid one."""
    variant: str = AS_FOUND
    """Which of VARIANTS is written: the one that predicted best."""

    @property
    def rigid(self) -> float:
        """RMS error of the rigid model over all parts, N or m."""
        return _pooled_rms(self.parts, [part.rigid for part in self.parts])

    @property
    def written(self) -> float:
        """RMS error of the written model over all parts, N or m."""
        return _pooled_rms(self.parts, [part.written for part in self.parts])

    def is_better_than(self, other: "Proof", *, by_standard_error: bool = False) -> bool:
        """Whether the written model predicts the same parts better than that of another proof.

        `by_standard_error`: the mean log ratio of the errors must also reach its standard error over the
        parts. Of two parts, neither may be predicted worse; of one there is no standard error.
        Source: the one-standard-error rule of Hastie, Tibshirani and Friedman (2009), section 7.10.
        """
        if self.written >= BETTER_RMS_RATIO * other.written:
            return False
        if not by_standard_error or len(self.parts) < 2:
            return True
        ours, others = (np.array([part.written for part in proof.parts]) for proof in (self, other))
        log_ratios = np.log(np.maximum(others, LEAST_RMS) / np.maximum(ours, LEAST_RMS))
        standard_error = log_ratios.std(ddof=1) / math.sqrt(len(log_ratios))
        return bool(log_ratios.mean() >= (1.0 - ROUNDING) * standard_error)

    @property
    def improves(self) -> bool:
        """Whether the written model predicts what was left out better than the rigid one."""
        return self.written < BETTER_RMS_RATIO * self.rigid


def proof_json(proof: Proof) -> dict[str, Any]:
    """An entry of `proof` in verdict.json."""
    return {
        "channel": proof.channel.value,
        "unit": "N" if proof.channel is ResidualChannel.FORCE else "m",
        "left_out": "the last third" if proof.is_last_third else "each recording in turn",
        "rigid": proof.rigid,
        "written": proof.written,
        "improves": proof.improves,
        "dropped": list(proof.dropped),
        "written_model": proof.variant,
        "parts": [
            {
                "recording": part.source,
                "measured": part.measured,
                "rigid": part.rigid,
                "written": part.written,
            }
            for part in proof.parts
        ],
    }


def _pooled_rms(parts: Sequence[HeldOutErrors], rms_of_parts: Sequence[float]) -> float:
    samples = sum(part.samples for part in parts)
    squares = sum(part.samples * rms**2 for part, rms in zip(parts, rms_of_parts, strict=True))
    return math.sqrt(squares / samples) if samples else 0.0
