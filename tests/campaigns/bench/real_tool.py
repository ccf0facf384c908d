"""`reconcile diagnose` in `make bench-real`: the force of the model file that it writes, loaded again.

Nothing is fitted to the recording that is judged: what is left is `before` of a second diagnosis.
"""

import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from reconcile.diagnosis.diagnose import diagnose
from reconcile.errors import ReconcileError


class ToolAnswer(NamedTuple):
    """What the tool says of some recordings."""

    verdict: str
    findings: list[dict[str, Any]]
    model: Path | None
    seconds: float
    failure: str = ""

    def names(self, axis: str) -> list[str]:
        """Effects of an axis with their confidence, as text."""
        own = [one for one in self.findings if one.get("axis") == axis]
        return [f"{one['effect']} {100.0 * one['confidence']:.0f} %" for one in own]


def ask(paths: Sequence[Path], nominal: Path, out: Path) -> ToolAnswer:
    """Diagnose; a refusal is an answer too."""
    started_s = time.perf_counter()
    try:
        found = diagnose(paths, nominal, out, with_report=False, with_next=False)
    except ReconcileError as refused:
        return ToolAnswer(
            "refused",
            [],
            None,
            time.perf_counter() - started_s,
            str(refused).replace(f"{nominal.parent}/", ""),
        )
    except Exception as error:  # noqa: BLE001  # the other recordings are wanted all the same
        failure = f"{type(error).__name__}: {error}"
        return ToolAnswer("failed", [], None, time.perf_counter() - started_s, failure)
    seconds = time.perf_counter() - started_s
    return ToolAnswer(found.verdict["verdict"], found.verdict["findings"], found.model_file, seconds)
