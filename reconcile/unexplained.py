"""What no effect explains is offered to the smooth terms."""

from __future__ import annotations

from typing import TYPE_CHECKING

from reconcile.smooth_terms import PREFIX

if TYPE_CHECKING:
    from reconcile.evidence import Rules, Trial
    from reconcile.ledger import Candidate


def unexplained(trial: Trial, chosen: list[Candidate], rules: Rules) -> list[Candidate]:
    """The smooth terms that what is left still asks for, at most two."""
    smooth = [c for c in trial.ledger.candidates if c.effect.startswith(PREFIX)]
    start = float(trial.unseen([]).sum())
    found: list[Candidate] = []
    while len(found) < rules.most_unknown:
        before = trial.unseen([*chosen, *found])
        scores = [trial.score([*chosen, *found], before, c) for c in smooth if c not in found]
        believed = [
            score
            for score in scores
            if score.beyond_chance(len(smooth), rules.false_alarm)
            and score.gain >= rules.least_unknown
            and float(before.sum() - score.squares.sum()) >= rules.least_unknown * start
        ]
        if not believed:
            break
        found.append(max(believed, key=lambda score: score.gain).candidate)
    return found
