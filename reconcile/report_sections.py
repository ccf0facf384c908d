"""The report's words as HTML: the answer, what was left out, where it shows, the fit. All text is escaped."""

from __future__ import annotations

import html
from typing import TYPE_CHECKING, Any

from reconcile.report_next import paragraph
from reconcile.report_words import (
    SENSES,
    differences,
    headline,
    interval,
    minor,
    parameter_names,
    percent,
    quantity,
    reading,
    title,
)

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

MOST_RIVALS = 5
MOST_PLACES = 12


def text(value: object) -> str:
    """Escaped."""
    return html.escape(str(value))


def answer(verdict: Mapping[str, Any], sources: Sequence[str]) -> str:
    """The verdict on top, with what to do."""
    said = headline(verdict)
    count = f"{len(sources)} recordings" if len(sources) > 1 else "one recording"
    return (
        f'<section class="card answer"><span class="word">verdict: {text(verdict["verdict"])}</span>'
        f"<h1>{text(said.sentence)}</h1><p>{text(said.advice)}</p>"
        f"<details><summary>From {count}</summary>"
        f'<p class="note">{"<br>".join(map(text, sources))}</p></details>'
        "</section>"
    )


def findings(verdict: Mapping[str, Any]) -> str:
    """A card for each effect, the one that is worth most first."""
    cards = [_finding(finding) for finding in verdict["findings"]]
    beside = f'<p class="note">{text(minor(verdict))}</p>' if verdict["minor"] else ""
    if not cards:
        return beside
    return f'<h2>What the model leaves out</h2><div class="plots">{"".join(cards)}</div>{beside}'


def _finding(finding: Mapping[str, Any]) -> str:
    sense = SENSES.get(finding["where"]["sensor"], finding["where"]["sensor"])
    names = parameter_names(finding["parameters"])
    rows = [[text(names[key]), text(interval(one))] for key, one in finding["parameters"].items()]
    parts = [
        f"<h3>{text(title(finding['effect']))}</h3>",
        f'<p class="faint">axis {text(finding["axis"])}, seen in {text(sense)}</p>',
        f"<p>{bar(finding['confidence'])} confidence {text(percent(finding['confidence']))}</p>",
        f"<p>{text(_capital(finding['explanation']))}. {text(_worth(finding['heldout_gain']))}</p>",
        tabulated(["parameter", "value (95 % interval)"], rows) if rows else "",
    ]
    if finding["equivalent"]:
        alike = ", ".join(title(name) for name in finding["equivalent"])
        parts.append(f"<p><strong>These recordings cannot tell it from:</strong> {text(alike)}.</p>")
    rivals = finding["runners_up"][:MOST_RIVALS]
    if rivals:
        lost = [
            [text(title(rival["effect"])), text(percent(rival["confidence"])), text(rival["why_not"])]
            for rival in rivals
        ]
        table = tabulated(["instead", "could be", "why not"], lost)
        summary = "<summary>What else was considered, and why it lost</summary>"
        parts.append(f"<details>{summary}{table}</details>")
    return f'<article class="card">{"".join(parts)}</article>'


def places(verdict: Mapping[str, Any]) -> str:
    """Where model and recording differ, ranked."""
    rows = [
        [
            text(entry["axis"]),
            text(SENSES.get(entry["sensor"], entry["sensor"])),
            text(_coordinate(entry)),
            text(_where(entry)),
            f"{bar(entry['share'])} {text(percent(entry['share']))}",
        ]
        for entry in sorted(verdict["located"], key=lambda one: -float(one["share"]))[:MOST_PLACES]
    ]
    if not rows:
        body = '<p class="note">Nowhere: what is left depends on nothing that was recorded.</p>'
    else:
        body = tabulated(["axis", "in", "over", "most of it", "share"], rows) + (
            '<p class="note">Share of the variance that no value of the nominal model explains: how much of '
            "it the mean over the coordinate explains, on blocks left out of that mean. Coordinates overlap, "
            "so the shares do not add up.</p>"
        )
    return f'<h2>Where model and recording differ</h2><section class="card">{body}</section>'


def fit(verdict: Mapping[str, Any]) -> str:
    """RMS before and after, on the blocks that were fitted and on those held out, against the noise floor."""
    rows = []
    noise = verdict.get("noise_floor", {})
    for axis, sense, levels in differences(verdict["fit"]):
        factor, unit = reading(levels["unit"], levels["before"]["heldout"])
        floor = noise.get(axis, {}).get(sense, {})
        cells = [text(axis), f"{text(SENSES[sense])} ({text(unit)})"]
        for part in ("train", "heldout"):
            cells += [f"{levels[model][part] / factor:.3g}" for model in ("before", "refitted", "after")]
        cells.append(f"{floor['rms'] / factor:.3g}" if "rms" in floor else "")
        rows.append(cells)
    head = ["axis", "RMS of"]
    for part in ("fitted blocks", "held out"):
        head += [f"{part}: nominal", "refitted", "with effects"]
    table = tabulated([*head, "noise floor"], rows, numbers=range(2, len(head) + 1))
    return f'<h2>Fit</h2><section class="card">{table}</section>'


def replays(verdict: Mapping[str, Any], pictures: str) -> str:
    """Errors of the closed loop with both models; nothing where no controller is known."""
    rows = []
    for axis, of_axis in verdict["fit"].items():
        for one in of_axis.get("replay", ()):
            factor, unit = reading("m", one["motor_rms_m"]["before"])
            cells = [text(axis), text(one["recording"])]
            cells += [f"{100.0 * one['force_error'][model]:.2f} %" for model in ("before", "after")]
            cells += [f"{one['motor_rms_m'][model] / factor:.3g} {unit}" for model in ("before", "after")]
            rows.append(cells)
    if not rows:
        return ""
    head = ["axis", "recording"]
    for what in ("force", "position"):
        head += [f"{what}: nominal", "with effects"]
    table = tabulated(head, rows, numbers=range(2, len(head)))
    note = (
        "RMS of what was replayed less what was recorded: of the motor force, over the RMS of the recorded "
        "force, and of the motor position."
    )
    return (
        f'<h2>Closed-loop replay</h2><section class="card">{table}<p class="note">{note}</p></section>'
        f'<div class="plots">{pictures}</div>'
    )


def remarks(verdict: Mapping[str, Any]) -> str:
    """What the sensors do, what they cannot show, what to record next."""
    parts = []
    if verdict["notes"]:
        parts.append(f"<h3>Timing, sensors and models</h3><ul>{_items(verdict['notes'])}</ul>")
    else:
        parts.append("<h3>Timing and sensors</h3><p>Nothing that could be taken for physics was found.</p>")
    if verdict["not_observable"]:
        items = [
            f"axis {entry['axis']}, {entry['why']}: {', '.join(title(name) for name in entry['effects'])}"
            for entry in verdict["not_observable"]
        ]
        parts.append(f"<h3>Not observable with these sensors</h3><ul>{_items(items)}</ul>")
    if verdict["next_experiment"]:
        parts.append(f"<h3>The next experiment</h3><p>{text(paragraph(verdict['next_experiment']))}</p>")
    return f'<h2>Sensors and limits</h2><section class="card">{"".join(parts)}</section>'


def _items(texts: Iterable[str]) -> str:
    return "".join(f"<li>{text(one)}</li>" for one in texts)


def tabulated(head: Sequence[str], rows: Sequence[Sequence[str]], numbers: Iterable[int] = ()) -> str:
    """A table; `rows` are HTML already, `numbers` the columns that stand to the right."""
    right = set(numbers)

    def cells(tag: str, row: Sequence[str]) -> str:
        marks = [' class="number"' if place in right else "" for place in range(len(row))]
        return "".join(f"<{tag}{mark}>{cell}</{tag}>" for mark, cell in zip(marks, row, strict=True))

    body = "".join(f"<tr>{cells('td', row)}</tr>" for row in rows)
    return f'<div class="scroll"><table><tr>{cells("th", list(map(text, head)))}</tr>{body}</table></div>'


def bar(share: float) -> str:
    """A bar of so much of one."""
    return f'<span class="bar"><i style="width:{100.0 * min(max(share, 0.0), 1.0):.0f}%"></i></span>'


def _worth(gain: float) -> str:
    """A gain of the squares as what more RMS there is without the effect."""
    if gain <= 0.0:
        return "Held-out blocks do not gain by it."
    more = 100.0 * ((1.0 - min(gain, 0.9999)) ** -0.5 - 1.0)
    return f"Without it the error on held-out blocks is {more:.0f} % larger."


def _capital(sentence: str) -> str:
    return sentence[:1].upper() + sentence[1:]


def _coordinate(entry: Mapping[str, Any]) -> str:
    name = {"constant": "everywhere", "direction": "direction of motion"}.get(
        entry["coordinate"], title(entry["coordinate"])
    )
    if entry.get("label") and entry["coordinate"] == "order":
        return f"{name}: {entry['label']}"
    return f"{name}, by direction" if entry.get("by_direction") and name != "direction of motion" else name


def _where(entry: Mapping[str, Any]) -> str:
    """`12.3 to 18.0 mm`, the name of a phase, or the size of a level."""
    unit = "N" if entry["sensor"] == "force" else "m"
    peak = entry.get("peak")
    size = f"{quantity(peak, unit)}" if peak is not None else ""
    if entry["coordinate"] in {"constant", "direction"} or "range" not in entry:
        return size
    low, high = entry["range"]
    if entry["coordinate"] in {"order", "frequency"}:
        return f"{entry['at']:.4g} {entry['unit']}, amplitude {size}"
    if entry.get("label"):
        return f"{entry['label']}, {size}"
    factor, name = reading(entry["unit"], max(abs(low), abs(high)))
    return f"{low / factor:.3g} to {high / factor:.3g} {name}, up to {size}"
