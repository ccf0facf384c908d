"""Leave each family out in turn: rules fitted on training cases of the others, scored on its fresh cases."""

from collections.abc import Mapping
from typing import Any, NamedTuple

from tests.campaigns.blind.families.decide import Rules
from tests.campaigns.blind.families.fit import fitted
from tests.campaigns.blind.families.score import Row, scores_of

BEGUN = Rules()
"""What the engine had before; from seeds of the older generator alone."""


class LeftOut(NamedTuple):
    """Each family under rules that no case of it had a part in."""

    rules: dict[str, Rules]
    scores: list[Row]


def leave_out(training: Mapping[str, Any], scored: Mapping[str, Any]) -> LeftOut:
    """Fit and score; both have `rows` of the trial.

    Raises:
        ValueError: the rows to fit on are of scored seeds.
    """
    if training["scored"]:
        raise ValueError("rules are fitted on training seeds: give rows that are not scored")
    rules, scores = {}, []
    for family in sorted({row["family"] for row in scored["rows"]}):
        rules[family] = fitted([row for row in training["rows"] if row["family"] != family], BEGUN)
        own = [row for row in scored["rows"] if row["family"] == family]
        scores += scores_of(own, rules[family])
    return LeftOut(rules, scores)
