"""The figures of the blind families as tables of docs/blind-trials.md: each family left out, worst, bar."""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

from tests.campaigns.blind.families.fit import fitted
from tests.campaigns.blind.families.score import scores_of, summary
from tests.campaigns.pages import rivals
from tests.campaigns.pages.leave_out import BEGUN, LeftOut, leave_out


class Bar(NamedTuple):
    """What the worst family must reach."""

    title: str
    share: float
    at_most: bool = False

    def met(self, share: float) -> bool:
        """Return whether a share is within the bar."""
        return share <= self.share if self.at_most else share >= self.share


BARS: dict[str, Bar | str] = {
    "right_of_single": Bar("one effect, observable: its name or declared class", 0.85),
    "first_of_single": "the same, before all other names",
    "false_names_quiet_and_foreign": Bar("quiet or foreign: a false name", 0.05, at_most=True),
    "false_names_beside_true": Bar("others: a false name", 0.08, at_most=True),
    "unknown_of_foreign": Bar("observable foreign physics: called unknown", 0.80),
    "all_of_several": Bar("two or three effects: all observable ones named", 0.70),
    "intervals_cover": Bar("intervals that hold the true value", 0.90),
    "unexplained_within_factor": "unexplained share told within a factor of 1.5",
    "unknown_of_quiet": "quiet: called unknown",
    "failed": "diagnosis failed",
}
"""Bars by the score's name, a mere title where the issue sets no share."""
ENOUGH = 20
"""Counts a family below which a bar is not called met, and names in a bin of confidences."""
CONFIDENCE_OFF = 0.05
"""Most by which a bin's mean confidence may differ from its share of names that are true."""
EDGES = (0.0, 0.5, 0.8, 0.9, 0.95, 0.99, 1.0)


def section(
    scored: Mapping[str, Any], training: Mapping[str, Any], answers: Sequence[Mapping[str, Any]] = ()
) -> str:
    """Return what stands between the marks of the page."""
    out = leave_out(training, scored)
    found, shipped = summary(out.scores), summary(scores_of(list(scored["rows"])))
    families = sorted(found)
    cases = {name: found[name]["failed"]["of"] for name in families}
    seeds = "fresh seeds" if scored["scored"] else "**training seeds, which are not proof**"
    counts = ", ".join(f"{name} {cases[name]}" for name in families)
    lines = [f"{sum(cases.values())} cases of {seeds}, engine {scored['engine']}: {counts}.", ""]
    lines += ["| score | bar | " + " | ".join(families) + " | worst | | rules not fitted: worst |"]
    lines += ["| --- | --- |" + " --- |" * (len(families) + 3)]
    lines += _rows(found, shipped, families)
    lines += ["", *_confidence(out.scores), *_rules(out, training), *_wrong(out.scores)]
    lines += rivals.section(scored["rows"], training["rows"], out.scores, answers)
    return "\n".join(lines)


def kept_out(scored: Mapping[str, Any], training: Mapping[str, Any]) -> str:
    """Return the table of families on which nothing was fitted, under rules fitted on all training cases."""
    scores = scores_of(list(scored["rows"]), fitted(list(training["rows"]), BEGUN))
    found, shipped = summary(scores), summary(scores_of(list(scored["rows"])))
    lines = [f"Engine {scored['engine']}."]
    for family in sorted(found):
        lines += ["", f"| {family}, score | bar | | rules fitted on all others | rules not fitted |"]
        lines += ["| --- | --- | --- | --- | --- |"]
        for name, bar in BARS.items():
            one = found[family][name]
            title, limit, verdict = _bar(bar, one["share"] if one["of"] else None, [one])
            cells = " | ".join(_cell(under[family][name]) for under in (found, shipped))
            lines.append(f"| {title} | {limit} | {verdict} | {cells} |")
    return "\n".join([*lines, "", *_wrong(scores)])


def _rows(found: Mapping[str, Any], shipped: Mapping[str, Any], families: Sequence[str]) -> Iterator[str]:
    for name, bar in BARS.items():
        of_family = {family: found[family][name] for family in families}
        low_is_good = bar.at_most if isinstance(bar, Bar) else name in {"failed", "unknown_of_quiet"}
        worst, before = (_worst(one, name, low_is_good=low_is_good) for one in (found, shipped))
        title, text, verdict = _bar(bar, worst, of_family.values())
        cells = " | ".join(_cell(one) for one in of_family.values())
        yield f"| {title} | {text} | {cells} | {_share(worst)} | {verdict} | {_share(before)} |"


def _bar(bar: Bar | str, worst: float | None, counted: Iterable[Mapping[str, Any]]) -> tuple[str, str, str]:
    """Return title, limit and verdict of a score; only the title where the issue sets no share."""
    if isinstance(bar, str):
        return bar, "", ""
    verdict = ""
    if worst is not None:
        enough = all(one["of"] >= ENOUGH for one in counted)
        verdict = ("met" if enough else "within, too few to say") if bar.met(worst) else "**missed**"
    return bar.title, f"{'at most' if bar.at_most else 'at least'} {bar.share:.2f}", verdict


def _worst(found: Mapping[str, Any], name: str, *, low_is_good: bool) -> float | None:
    counted = [figures[name]["share"] for figures in found.values() if figures[name]["of"]]
    return (max if low_is_good else min)(counted) if counted else None


def _share(value: float | None) -> str:
    return "-" if value is None else f"{value:.2f}"


def _cell(one: Mapping[str, Any]) -> str:
    return f"{round(one['share'] * one['of'])} of {one['of']}" if one["of"] else "-"


def _confidence(scores: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    """Yield a table of the names by stated confidence, and how many of them were not false."""
    names = [
        (finding["confidence"], finding["effect"] not in row["false"])
        for row in scores
        if "error" not in row
        for finding in row["findings"]
        if finding["effect"] != "unknown"
    ]
    if not names:
        return
    yield "| confidence said | names | not false | mean said | within 0.05 |"
    yield "| --- | --- | --- | --- | --- |"
    for low, high in pairwise(EDGES):
        inside = [one for one in names if low <= one[0] < high or (high == 1.0 and one[0] == 1.0)]
        if inside:
            true = sum(right for _, right in inside) / len(inside)
            said = sum(sure for sure, _ in inside) / len(inside)
            near = "met" if abs(true - said) <= CONFIDENCE_OFF else "**missed**"
            verdict = near if len(inside) >= ENOUGH else "too few to say"
            yield f"| {low:.2f} to {high:.2f} | {len(inside)} | {true:.2f} | {said:.2f} | {verdict} |"
    yield ""


def _rules(out: LeftOut, training: Mapping[str, Any]) -> Iterator[str]:
    """Yield the constants that each left-out family was scored with, and what they were before."""
    names = [
        name
        for name in BEGUN._fields
        if any(getattr(rules, name) != getattr(BEGUN, name) for rules in out.rules.values())
    ]
    yield f"Fitted on {len(training['rows'])} training cases, engine {training['engine']}:"
    yield ""
    yield "| left out | fitted on | " + " | ".join(f"`{name}`" for name in names) + " |"
    yield "| --- | --- |" + " --- |" * len(names)
    yield "| before | older generator | " + " | ".join(f"{getattr(BEGUN, name):g}" for name in names) + " |"
    for family, rules in out.rules.items():
        count = sum(row["family"] != family for row in training["rows"])
        yield f"| {family} | {count} | " + " | ".join(f"{getattr(rules, name):g}" for name in names) + " |"
    yield ""


def _wrong(scores: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    """Yield what was missed and what was falsely named, the most frequent first."""
    missed = Counter(
        name for row in scores for name, right in row.get("right", {}).items() if not right
    ).most_common()
    observable = Counter(name for row in scores for name in row.get("right", {}))
    false = Counter(name for row in scores for name in row.get("false", [])).most_common()
    text = ", ".join(f"{name} {count} of {observable[name]}" for name, count in missed)
    yield f"Observable effects not named: {text or 'none'}."
    text = ", ".join(f"{name} {count}" for name, count in false)
    yield f"False names: {text or 'none'}."
    unclear = Counter(
        key.split(".")[0] for row in scores for key, held in row.get("covered", {}).items() if not held
    ).most_common()
    text = ", ".join(f"{name} {count}" for name, count in unclear)
    bare = Counter(
        name for row in scores for name in row.get("right", {}) if name not in row["with_parameter"]
    ).most_common()
    without = ", ".join(f"{name} {count}" for name, count in bare)
    yield f"Intervals that miss: {text or 'none'}."
    for row in scores:
        if "error" in row:  # the last line that the tool wrote
            why = row["error"] if isinstance(row["error"], str) else row["error"][-1]
            yield f"No verdict on {row['family']} {row['seed']}: {why}"
    yield f"Observable effects without a true parameter: {without or 'none'}."
    yield ""
