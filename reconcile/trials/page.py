"""`reconcile trial --page`: the scores of blind trials, generated from their JSON."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from reconcile.trials.seeds import FIRST_SCORED_SEED
from servo_ctrl.files.whole_file import write_text_whole, write_whole
from servo_ctrl.plots.matplotlib_agg import Figure

SCORE_TEXTS: dict[str, tuple[str, str]] = {
    "right_first_name": ("one effect, observable: its own name comes first", ""),
    "right_first_name_or_class": ("the same, or a name of its declared class", "at least 0.90"),
    "named_at_all": ("the same effect named, in whatever place", ""),
    "abstained": ("one effect, observable: no name but clutter was given", ""),
    "said_unknown_of_known": ("one effect, observable: called unknown", ""),
    "all_of_several": ("two or three effects: all the observable ones named", "at least 0.75"),
    "false_names_quiet": ("no effect, or physics outside the catalogue: a false name", "at most 0.05"),
    "false_names_effect_free": ("of these, with no effect", ""),
    "false_names_foreign": ("of these, with physics outside the catalogue", ""),
    "false_names_beside_planted": ("observable effects: a false name beside them or instead", ""),
    "false_names_not_observable": ("effects that cannot be seen: a false name", ""),
    "unknown_called_unknown": (
        "physics outside the catalogue: called unknown, no false name",
        "at least 0.80",
    ),
    "intervals_cover": ("95 % intervals that hold the true value", "at least 0.90"),
    "parameter_error_median": ("median relative error of a parameter", ""),
    "achieved_gain": ("held-out gain, share of the achievable, median", "at least 0.90"),
    "achieved_gain_mean": ("the same, mean (each not below -1)", ""),
    "seconds_median": ("seconds a case", ""),
    "failed": ("diagnosis failed", ""),
}
TRAINED_ON = (
    "Seeds 0 to 9999 are for training and never scored. Thresholds, the terms without a name, what an "
    "interval allows for laws of another form, and the calibration of confidences come from 0 to 69 and 300 "
    "to 469, and from 100000 to 100399: earlier engines were scored on these, from 100000 on, and the "
    "ranking of findings and the widths of intervals were set after a look at that. 100400 to 100599 were "
    f"scored once; that page has been read, so {FIRST_SCORED_SEED} is the first fresh seed. "
    "Who wrote the terms without a name knew which kinds of foreign physics this generator has, not "
    "where and how large they are in the scored seeds. The rank of a name does not stand on an equal "
    "footing with another tool's: ours puts what every axis has behind others of up to half its size, a "
    "rule that was made on this generator."
)
RULES = """## How it is done

`reconcile trial --seed {first} --cases {cases} --json FILE --page PAGE` makes this page. A
generator in `tests/campaigns/blind`, which imports nothing of `hil_sim`, `servo_ctrl` or `reconcile` and
writes the laws in another form wherever there is one, draws for each seed an axis (10 to 150 kg, 3 to 40 N of
Coulomb friction, screws of 2 to 20 mm and linear motors), a controller (P-PI or PID, on motor or scale),
sensors (counts, coloured noise, wander, re-zeroed encoders, with or without scale and temperature, force as
command or as measured current), 2 to 7 recordings of 10 to 25 s (test motions, or circles and moves of
production only), and what is concealed: nothing, one effect, two or three, or physics that stands in no
catalogue. Its axis is simulated by position Verlet at 25 us; friction is Bouc-Wen's, Stribeck's fall is
algebraic, a play's contact is Hunt and Crossley's, breakaway ages by the logarithm of Dieterich and Ruina,
iron saturates by an arctangent, the current lags by second order, ripples are not sines. Some laws have one
form only and are the same on both sides: a constant force, a pure delay, viscous friction that differs by
direction, an error in proportion to the position, a linear spring, the line of force over speed that a
voltage allows, a mass that is towed. Always there are presliding over micrometres, a small ripple and
coloured noise; they may be named or not, but where one that is less than half as large as the concealed
effect comes first, that is not right.

The nominal model is fitted by least squares on the recordings (most cases: it hides what it can), or is a
data sheet, or wrong by 15 to 55 %. The truth is written into a folder of its own and hashed; the hash is
printed before the diagnosis, the truth after it.

**Seeds.** {seeds}

**Observable** is what these sensors and motions can show, whatever a tool finds
(`tests/campaigns/blind/observability.py`):

1. what shows between motor and scale only needs a scale; what happens between command and current needs the
   command as the recorded force;
2. behind a low pass of 40 Hz, and as far as mass, viscous and Coulomb friction and timing cannot stand in
   for it, its RMS is half of the noise's or more, or that of its strongest twentieth three times the
   noise's; and it holds 2 % or more of the square of what a fitted nominal model leaves;
3. its motion was made: slow constant speeds for Stribeck friction, rests of different lengths for
   breakaway, changing force for torque ripple.

A lag of the current loop that a delay would imitate to within half the noise, or the other way round, is of
one class with it; so are a constant force and asymmetric Coulomb friction, a periodic lead error and an
eccentric encoder. A finding whose declared equivalents hold the name counts as its class, unless that name is
a finding too.

**Achievable gain**: the generator writes down each effect's own force (and deviation) at every sample.
Taken away from the recording, and the model's values fitted anew on the same blocks, they leave a held-out
RMS n; the nominal model, refitted, leaves b, the verdict's model a. The share is (b^2 - a^2) / (b^2 - n^2).

Where another tool is asked beside, it gets the same files and is scored by the same rule. It states no
parameters and no `unknown`. What it leaves on the blocks that it holds out itself, over what the refitted
model leaves there, stands for its a / b.

Seconds are those of a diagnosis without its report and next experiment, two cases side by side. Shares have
Wilson's intervals, the others are bootstrapped over cases; 95 %.
"""


def write_page(content: Mapping[str, Any], file: Path) -> None:
    """Write the page, and its figure beside it. Raises OSError."""
    picture = file.with_suffix(".png")
    file.parent.mkdir(parents=True, exist_ok=True)
    write_whole(picture, lambda temporary: _picture(content).savefig(temporary, format="png", dpi=110))
    write_text_whole(file, page(content, picture.name))


def page(content: Mapping[str, Any], picture: str) -> str:
    """Return the page as Markdown."""
    found, rows = content["summary"], content["rows"]
    first, cases = content["first_seed"], content["cases"]
    kinds = ", ".join(
        f"{sum(row['kind'] == kind for row in rows)} {meaning}"
        for kind, meaning in (
            ("single", "with one effect"),
            ("several", "with two or three"),
            ("none", "with none"),
            ("parameters", "with none but wrong values"),
            ("foreign", "with physics outside the catalogue"),
        )
    )
    seeds = (
        f"This page: {first} to {first + cases - 1}. "
        + ("" if content["scored"] else "**These are training seeds: no proof.** ")
        + TRAINED_ON
    )
    other = content.get("beside")
    asked = [row["beside"] for row in rows if "beside" in row]
    same = "same cases" if len(asked) == cases else f"first {len(asked)} of these cases"
    name_of_other = f" {other['name']}, {same} |" if other else ""
    lines = [
        "# Blind trials",
        "",
        "Generated from the JSON of `reconcile trial`; do not edit.",
        "",
        f"{cases} cases: {kinds}.",
        "",
        f"| score | value | 95 % | of | bar |{name_of_other}",
        f"| --- | --- | --- | --- | --- |{' --- |' if other else ''}",
        *(
            _score_line(name, found["scores"][name])
            + (_other_cell(other["summary"]["scores"][name]) if other else "")
            for name in SCORE_TEXTS
        ),
        "",
        f"![Scores by effect, and how often names were true by how sure they were]({picture})",
        "",
        "## By effect",
        "",
        "| effect | alone: first | anywhere, alone or with others | named first instead |",
        "| --- | --- | --- | --- |",
        *(_effect_line(entry, found["confusion"]) for entry in found["by_effect"]),
        "",
        "## Confidences",
        "",
        "| said | names | true | 95 % |",
        "| --- | --- | --- | --- |",
        *(
            f"| {b['from']:.2f} to {b['to']:.2f} | {b['of']} | {b['right']:.2f} "
            f"| {b['ci95'][0]:.2f} to {b['ci95'][1]:.2f} |"
            for b in found["reliability"]
            if b["of"]
        ),
        "",
        RULES.format(first=first, cases=cases, seeds=seeds),
    ]
    return "\n".join(lines)


def _score_line(name: str, score: Mapping[str, Any]) -> str:
    meaning, bar = SCORE_TEXTS[name]
    low, high = score["ci95"]
    if score["value"] is None:
        return f"| {meaning} | - | - | 0 | {bar} |"
    return f"| {meaning} | {score['value']:.2f} | {low:.2f} to {high:.2f} | {score['of']} | {bar} |"


def _other_cell(score: Mapping[str, Any]) -> str:
    if score["value"] is None:
        return " - |"
    low, high = score["ci95"]
    return f" {score['value']:.2f} ({low:.2f} to {high:.2f}) |"


def _effect_line(entry: Mapping[str, Any], confusion: Mapping[str, Mapping[str, int]]) -> str:
    instead = {
        name: count
        for name, count in confusion.get(entry["effect"], {}).items()
        if name not in {"right", "class"}
    }
    listed = ", ".join(f"{name} {count}" for name, count in instead.items())
    return (
        f"| `{entry['effect']}` | {entry['first']} of {entry['single']} "
        f"| {entry['found']} of {entry['planted']} | {listed} |"
    )


def _picture(content: Mapping[str, Any]) -> Figure:
    found = content["summary"]
    figure = Figure(figsize=(11.0, 6.0), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(3, 2))
    table = list(reversed(found["by_effect"]))
    left.barh([e["effect"] for e in table], [e["planted"] for e in table], color="#d8d8d8", label="planted")
    left.barh([e["effect"] for e in table], [e["found"] for e in table], color="#3b78b4", label="named")
    left.set_xlabel("cases")
    left.legend(loc="lower right")
    bins = [b for b in found["reliability"] if b["of"]]
    right.plot([0.0, 1.0], [0.0, 1.0], color="0.6", linewidth=1.0)
    for b in bins:
        right.plot([b["stated"]] * 2, b["ci95"], color="#3b78b4", linewidth=1.0)
    right.scatter([b["stated"] for b in bins], [b["right"] for b in bins], color="#3b78b4")
    limits = {"xlim": (0.0, 1.02), "ylim": (0.0, 1.02)}
    right.set(xlabel="confidence said", ylabel="share of names that were true", **limits)
    return figure
