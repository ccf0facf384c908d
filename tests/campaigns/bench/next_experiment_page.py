"""The figures of docs/next-experiment.md: the summary of the bench's rows, and a table and a picture of both.

Run as `python -m tests.campaigns.bench.next_experiment_page next_experiment.json docs/next-experiment.md`.
"""

import json
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import typer
from matplotlib.figure import Figure

from tests.campaigns.bench.main import write_whole

BEGIN, END = "<!-- figures: tests/campaigns/bench/next_experiment_page.py -->", "<!-- end -->"
WAYS = {"next": "the next experiment", "fixed": "fixed programme"}
PICTURE = Path("pictures") / "next_experiment.png"
RESAMPLES = 4000
"""Bootstrap resamples of the intervals."""


def summary(rows: Sequence[dict[str, Any]], most: int) -> dict[str, Any]:
    """Return means over cases; one that is never right counts as `most` + 1 recordings."""
    counted = [row for row in rows if "next" in row]
    if not counted:
        return {"cases": 0}
    counts = {way: np.array([_count(row[way], most) for row in counted]) for way in ("fixed", "next")}
    rng = np.random.default_rng(0)
    draws = rng.integers(len(counted), size=(RESAMPLES, len(counted)))
    saved = counts["fixed"] - counts["next"]
    found: dict[str, Any] = {
        "cases": len(counted),
        "drawn": len(rows),
        "right_at_once": sum(not row["ambiguous"] for row in rows),
        "not_observable": sum(row["ambiguous"] and not row["observable"] for row in rows),
        "saved": _with_interval(saved, draws),
    }
    for way, own in counts.items():
        found[way] = {
            "recordings": _with_interval(own, draws),
            "right_within": [float(np.mean(own <= count)) for count in range(1, most + 1)],
            "never": _with_interval((own > most).astype(float), draws),
        }
    return found


def _count(way: dict[str, Any], most: int) -> float:
    return float(way["recordings"] or most + 1)


def _with_interval(values: np.ndarray[Any, Any], draws: np.ndarray[Any, Any]) -> dict[str, Any]:
    low, high = np.percentile(values[draws].mean(axis=1), [2.5, 97.5])
    return {"mean": float(values.mean()), "ci95": [float(low), float(high)]}


def write_figures(content: Mapping[str, Any], page: Path) -> None:
    """Replace what stands between the marks of the page; the picture lies beside it."""
    text = page.read_text(encoding="utf-8")
    figures = f"{BEGIN}\n{table(content)}\n{END}"
    write_whole(page, re.sub(f"{re.escape(BEGIN)}.*?{END}", lambda _: figures, text, flags=re.DOTALL))
    picture(content, page.parent / PICTURE)


def table(content: Mapping[str, Any]) -> str:
    """The summary, and a row for each case."""
    of, rows = content["summary"], content["rows"]
    most = len(of["fixed"]["right_within"])
    drawn = (
        f"{of['drawn']} cases were drawn, seeds {rows[0]['seed']} to {rows[-1]['seed']}: "
        f"{of['right_at_once']} were right after the first recording, {of['not_observable']} cannot be seen "
        f"by any motion of the programme, {of['cases']} are ambiguous and counted."
    )
    lines = [
        drawn,
        "",
        "| further recordings until right | mean [95 %] | "
        + " | ".join(f"within {k}" for k in range(1, most + 1))
        + " |",
        "| --- " * (most + 2) + "|",
    ]
    for way, words in WAYS.items():
        own = of[way]
        shares = " | ".join(f"{100.0 * share:.0f} %" for share in own["right_within"])
        lines.append(f"| {words} | {_interval(own['recordings'])} | {shares} |")
    lines += [
        f"| saved by asking | {_interval(of['saved'])} |" + " |" * most,
        "",
        "| seed | concealed | first | the next experiment | fixed programme | asked for |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for row in rows:
        if "next" in row:
            asked = "; ".join(one["motion"].split(":")[0] for one in row["next"]["asked"])
            counts = " | ".join(str(row[way]["recordings"] or "not") for way in WAYS)
            lines.append(f"| {row['seed']} | `{row['effect']}` | {row['first']} | {counts} | {asked} |")
    return "\n".join(lines)


def picture(content: Mapping[str, Any], file: Path) -> None:
    """Share of the cases that are right after so many further recordings."""
    figure = Figure(figsize=(6.0, 3.4), layout="constrained")
    axes = figure.add_subplot()
    for (way, words), style in zip(WAYS.items(), ("o-", "s--"), strict=True):
        shares = [0.0, *content["summary"][way]["right_within"]]
        axes.plot(range(len(shares)), [100.0 * share for share in shares], style, label=words)
    axes.set_xlabel("further recordings")
    axes.set_ylabel("right verdicts, %")
    axes.set_ylim(0.0, 100.0)
    axes.grid(alpha=0.3)
    axes.legend()
    figure.savefig(file, dpi=110)


def _interval(of: Mapping[str, Any]) -> str:
    low, high = of["ci95"]
    return f"{of['mean']:.2f} [{low:.2f}, {high:.2f}]"


def main(json_file: Path, page: Path) -> None:
    """Write the figures again."""
    write_figures(json.loads(json_file.read_text(encoding="utf-8")), page)


if __name__ == "__main__":
    typer.run(main)
