"""The figures of the blind families as tables of docs/blind-families.md: each family, worst, bar."""

from collections.abc import Iterator, Mapping
from itertools import pairwise
from typing import Any, NamedTuple


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
"""Counts a family below which a bar is not called met."""
NOT_MEASURED = (
    "held-out gain as a share of the achievable, PySINDy and the other rivals on the same cases, and "
    "thresholds fitted anew without the family that is scored"
)


def section(result: Mapping[str, Any]) -> str:
    """Return what stands between the marks of the page."""
    families = sorted(result["summary"])
    cases = {name: result["summary"][name]["failed"]["of"] for name in families}
    seeds = "scored seeds" if result["scored"] else "**training seeds, which are no proof**"
    counts = ", ".join(f"{name} {cases[name]}" for name in families)
    lines = [f"{sum(cases.values())} cases of {seeds}, engine {result['engine']}: {counts}.", ""]
    lines += ["| score | bar | " + " | ".join(families) + " | worst | |"]
    lines += ["| --- | --- |" + " --- |" * (len(families) + 2)]
    lines += _rows(result["summary"], families)
    lines += ["", *_confidence(result.get("rows", []))]
    lines += [f"Not measured: {NOT_MEASURED}.", ""]
    return "\n".join(lines)


def _rows(summary: Mapping[str, Any], families: list[str]) -> Iterator[str]:
    for name, bar in BARS.items():
        of_family = {family: summary[family][name] for family in families}
        counted = [one["share"] for one in of_family.values() if one["of"]]
        at_most = bar.at_most if isinstance(bar, Bar) else name in {"failed", "unknown_of_quiet"}
        worst = (max if at_most else min)(counted) if counted else None
        title = bar.title if isinstance(bar, Bar) else bar
        told = f"{'at most' if at_most else 'at least'} {bar.share:.2f}" if isinstance(bar, Bar) else ""
        verdict = ""
        if isinstance(bar, Bar) and worst is not None:
            enough = all(one["of"] >= ENOUGH for one in of_family.values())
            verdict = ("met" if enough else "within, too few to say") if bar.met(worst) else "**missed**"
        cells = " | ".join(_cell(one) for one in of_family.values())
        yield f"| {title} | {told} | {cells} | {'-' if worst is None else f'{worst:.2f}'} | {verdict} |"


def _cell(one: Mapping[str, Any]) -> str:
    return f"{round(one['share'] * one['of'])} of {one['of']}" if one["of"] else "-"


def _confidence(rows: list[Mapping[str, Any]]) -> Iterator[str]:
    """Yield a table of the names by stated confidence, and how many of them were not false."""
    edges = (0.0, 0.5, 0.8, 0.9, 0.95, 0.99, 1.0)
    names = [
        (finding["confidence"], finding["effect"] not in row["false"])
        for row in rows
        if "error" not in row
        for finding in row["findings"]
        if finding["effect"] != "unknown"
    ]
    if not names:
        return
    yield "| confidence said | names | not false | mean said |"
    yield "| --- | --- | --- | --- |"
    for low, high in pairwise(edges):
        inside = [one for one in names if low <= one[0] < high or (high == 1.0 and one[0] == 1.0)]
        if inside:
            true = sum(right for _, right in inside) / len(inside)
            said = sum(sure for sure, _ in inside) / len(inside)
            yield f"| {low:.2f} to {high:.2f} | {len(inside)} | {true:.2f} | {said:.2f} |"
    yield ""
