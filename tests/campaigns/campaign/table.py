"""Summarises a campaign for campaign.json: by fault and state, and the violations by seed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tests.campaigns.campaign.journal import Result

FORMAT = 1


def cell(results: Sequence[Result]) -> dict[str, Any]:
    """Return the figures of the runs of one fault in one state."""
    seen = [result for result in results if result.cycles is not None]
    latest = max(seen, key=lambda result: (result.cycles or 0) - (result.bound or 0), default=None)
    return {
        "runs": len(results),
        "happened": sum(result.injected for result in results),
        "reactions": len(seen),
        "worst_cycles": None if latest is None else latest.cycles,
        "bound_cycles": None if latest is None else latest.bound,
        "worst_seed": None if latest is None else latest.seed,
        "violations": sum(bool(result.violations) for result in results),
    }


def summary(results: Sequence[Result]) -> dict[str, Any]:
    """Return the summary of all results."""
    pairs = sorted({(result.fault, result.state) for result in results})
    faults: dict[str, dict[str, Any]] = {}
    for fault, state in pairs:
        results_of_pair = [result for result in results if (result.fault, result.state) == (fault, state)]
        faults.setdefault(fault, {})[state] = cell(results_of_pair)
    violating = [result for result in results if result.violations]
    return {
        "format": FORMAT,
        "runs": len(results),
        "happened": sum(result.injected for result in results),
        "reactions": sum(result.cycles is not None for result in results),
        "runs_with_violations": len(violating),
        "faults": faults,
        "violations": [
            {
                "seed": result.seed,
                "fault": result.fault,
                "state": result.state,
                "pacing": result.pacing,
                "violations": list(result.violations),
            }
            for result in sorted(violating)
        ],
    }
