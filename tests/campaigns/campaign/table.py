"""What a campaign has shown, as campaign.json has it: by fault and state, and violations by their seeds."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tests.campaigns.campaign.journal import Result

FORMAT = 1


def cell(results: Sequence[Result]) -> dict[str, Any]:
    """Of the runs of one fault in one state."""
    seen = [result for result in results if result.cycles is not None]
    worst = max(seen, key=lambda result: (result.cycles or 0) - (result.bound or 0), default=None)
    return {
        "runs": len(results),
        "happened": sum(result.happened for result in results),
        "reactions": len(seen),
        "worst_cycles": None if worst is None else worst.cycles,
        "bound_cycles": None if worst is None else worst.bound,
        "worst_seed": None if worst is None else worst.seed,
        "violations": sum(bool(result.violations) for result in results),
    }


def summary(results: Sequence[Result]) -> dict[str, Any]:
    """All of it."""
    pairs = sorted({(result.fault, result.state) for result in results})
    faults: dict[str, dict[str, Any]] = {}
    for fault, state in pairs:
        here = [result for result in results if (result.fault, result.state) == (fault, state)]
        faults.setdefault(fault, {})[state] = cell(here)
    bad = [result for result in results if result.violations]
    return {
        "format": FORMAT,
        "runs": len(results),
        "happened": sum(result.happened for result in results),
        "reactions": sum(result.cycles is not None for result in results),
        "runs_with_violations": len(bad),
        "faults": faults,
        "violations": [
            {
                "seed": result.seed,
                "fault": result.fault,
                "state": result.state,
                "pacing": result.pacing,
                "violations": list(result.violations),
            }
            for result in sorted(bad)
        ],
    }
