"""Text and tables of `report.html`: verdict, findings, locations, fit, replay, remarks."""

from collections.abc import Mapping, Sequence
from typing import Any

from kernels.readable_units import display_unit
from reconcile.formats.rotary_units import sentence_of, unit_of
from reconcile.report.experiment_text import next_experiment_text
from reconcile.report.html_page import answer, bar, bullets, grid, note, section
from reconcile.report.words import (
    CHANNEL_NAMES,
    capitalised,
    display_name,
    headline,
    interval,
    is_rotary,
    minor_effects,
    parameter_names,
    percent,
    quantity,
    residual_levels,
)
from servo_ctrl.report.html_file import escape, table

MAX_RIVALS, MAX_LOCATIONS = 5, 12
"""Most rows of their tables; verdict.json has all."""


def verdict_card(verdict: Mapping[str, Any], sources: Sequence[str]) -> str:
    """Return the verdict in a sentence, advice, and the recordings on which it is based."""
    summary = headline(verdict)
    count = f"{len(sources)} recordings" if len(sources) > 1 else "one recording"
    return answer(
        f"verdict: {verdict['verdict']}",
        summary.sentence,
        f"<p>{escape(summary.advice)}</p><details><summary>From {count}</summary>"
        f'<p class="note" translate="no">{"<br>".join(map(escape, sources))}</p></details>',
    )


def findings(verdict: Mapping[str, Any], curves: Mapping[int, str]) -> str:
    """Return a card for each identified effect, in the order of the verdict.

    `curves`: HTML of the picture that replaces the values of a finding, by its index.
    """
    cards = [_finding_card(finding, curves.get(index)) for index, finding in enumerate(verdict["findings"])]
    minor = note(minor_effects(verdict)) if verdict["minor"] else ""
    return f"<h2>What the model leaves out</h2>{grid(cards)}{minor}" if cards else minor


def _finding_card(finding: Mapping[str, Any], curve: str | None) -> str:
    channel = CHANNEL_NAMES.get(finding["where"]["sensor"], finding["where"]["sensor"])
    parameters = finding["parameters"]
    names = parameter_names(parameters)
    values = [[escape(names[key]), escape(interval(parameter))] for key, parameter in parameters.items()]
    parts = [
        f"<h3>{escape(display_name(finding['effect']))}</h3>",
        f'<p class="faint">axis {escape(finding["axis"])}, seen in {escape(channel)}</p>',
        f"<p>{bar(finding['confidence'])} confidence {escape(percent(finding['confidence']))}</p>",
        f"<p>{escape(capitalised(finding['explanation']))}. {escape(_gain(finding['heldout_gain']))}</p>",
        curve or (table(["parameter", "value (95 % interval)"], values) if values else ""),
    ]
    if finding["equivalent"]:
        equivalent = ", ".join(map(display_name, finding["equivalent"]))
        parts.append(f"<p><strong>These recordings cannot tell it from:</strong> {escape(equivalent)}.</p>")
    rivals = [
        [
            escape(display_name(rival["effect"])),
            escape(percent(rival["confidence"])),
            escape(rival["why_not"]),
        ]
        for rival in finding["runners_up"][:MAX_RIVALS]
    ]
    if rivals:
        summary = "<summary>What else was considered, and why it lost</summary>"
        parts.append(f"<details>{summary}{table(['instead', 'could be', 'why not'], rivals)}</details>")
    return f'<article class="card">{"".join(parts)}</article>'


def locations(verdict: Mapping[str, Any]) -> str:
    """Return the coordinates over which model and recording differ, the largest explained share first."""
    heading = "Where model and recording differ"
    ranked = sorted(verdict["located"], key=lambda entry: -float(entry["share"]))
    rows = [
        [
            escape(entry["axis"]),
            escape(CHANNEL_NAMES.get(entry["sensor"], entry["sensor"])),
            escape(_coordinate(entry)),
            escape(_range(entry)),
            f"{bar(entry['share'])} {escape(percent(entry['share']))}",
        ]
        for entry in ranked[:MAX_LOCATIONS]
    ]
    if not rows:
        return section(heading, note("Nowhere: the residual depends on nothing that was recorded."))
    meaning = note(
        "Share of the variance that no value of the nominal model explains: how much of "
        "it the mean over the coordinate explains, on blocks left out of that mean. Coordinates overlap, "
        "so the shares do not add up."
    )
    return section(heading, table(["axis", "in", "over", "most of it", "share"], rows), meaning)


def fit(verdict: Mapping[str, Any]) -> str:
    """Return the RMS of the residuals on fitted and held-out blocks, and the noise floor."""
    rows = []
    noise = verdict.get("noise_floor", {})
    for axis, channel, levels in residual_levels(verdict["fit"]):
        factor, unit = display_unit(levels["unit"], levels["before"]["heldout"])
        floor = noise.get(axis, {}).get(channel, {})
        cells = [escape(axis), f"{escape(CHANNEL_NAMES[channel])} ({escape(unit)})"]
        for blocks in ("train", "heldout"):
            cells += [f"{levels[model][blocks] / factor:.3g}" for model in ("before", "refitted", "after")]
        cells.append(f"{floor['rms'] / factor:.3g}" if "rms" in floor else "")
        rows.append(cells)
    head = ["axis", "RMS of"]
    for blocks in ("fitted blocks", "held out"):
        head += [f"{blocks}: nominal", "refitted", "with effects"]
    return section("Fit", table([*head, "noise floor"], rows, numeric=range(2, len(head) + 1)))


def proof(verdict: Mapping[str, Any]) -> str:
    """Return the errors on held-out parts, part by part; empty without a proof."""
    rows = []
    for axis, of_axis in verdict.get("proof", {}).items():
        for of_channel in of_axis:
            for part in of_channel["parts"]:
                factor, unit = display_unit(of_channel["unit"], part["measured"])
                cells = [axis, f"{CHANNEL_NAMES[of_channel['channel']]} ({unit})", part["recording"]]
                errors = [f"{part[key] / factor:.3g}" for key in ("measured", "rigid", "written")]
                rows.append([*map(escape, cells), *errors])
    if not rows:
        return ""
    meaning = note(
        "Each recording is left out in turn, or the last third of a single one. The model that the others "
        "give is written as a file and loaded again, and no value is fitted to what was left out. The rigid "
        "model is mass, viscous and Coulomb friction, refitted on the same recordings."
    )
    head = ["axis", "RMS of", "left out", "measured", "rigid", "model.toml"]
    return section("Proof on what was left out", table(head, rows, numeric=range(3, 6)), meaning)


def accounted(verdict: Mapping[str, Any]) -> str:
    """Return the contribution of each part of the model, and the unexplained residual."""
    rows = []
    for axis, of_axis in verdict.get("accounted", {}).items():
        for channel, sizes in of_axis.items():
            factor, unit = display_unit(sizes["unit"], sizes["measured"])
            for name, part in sizes["parts"].items():
                cells = [axis, f"{CHANNEL_NAMES[channel]} ({unit})", display_name(name)]
                share = percent(part["share"])
                rows.append([*map(escape, cells), f"{part['rms'] / factor:.3g}", escape(share)])
    if not rows:
        return ""
    meaning = note("Shares are of the squares of what was measured. Parts overlap: they need not add up.")
    head = ["axis", "RMS of", "part", "RMS", "share"]
    withdrawn = [
        f"{display_name(entry['effect'])} (axis {entry['axis']}): {entry['why']}"
        for entry in verdict["withdrawn"]
    ]
    not_named = f"<h3>Fitted, and not named</h3>{bullets(withdrawn)}" if withdrawn else ""
    all_rotary = all(is_rotary(verdict, axis) for axis in verdict["accounted"])
    heading = f"Every {sentence_of('newton', rotary=all_rotary)} accounted for"
    return section(heading, table(head, rows, numeric=(3, 4)), meaning, not_named)


def replays(verdict: Mapping[str, Any], cards: Sequence[str]) -> str:
    """Return the errors of the closed-loop replays; empty where no controller is known."""
    rows = []
    for axis, of_axis in verdict["fit"].items():
        for replay in of_axis.get("replay", ()):
            motor_rms_m = replay["motor_rms_m"]
            factor, unit = display_unit(unit_of("m", rotary=is_rotary(verdict, axis)), motor_rms_m["before"])
            cells = [escape(axis), escape(replay["recording"])]
            cells += [f"{100.0 * replay['force_error'][model]:.2f} %" for model in ("before", "after")]
            cells += [f"{motor_rms_m[model] / factor:.3g} {unit}" for model in ("before", "after")]
            rows.append(cells)
    if not rows:
        return ""
    head = ["axis", "recording"]
    for quantity_name in ("force", "position"):
        head += [f"{quantity_name}: nominal", "with effects"]
    meaning = note(
        "RMS of what was replayed less what was recorded: of the motor force, over the RMS of the recorded "
        "force, and of the motor position."
    )
    errors = table(head, rows, numeric=range(2, len(head)))
    return section("Closed-loop replay", errors, meaning) + grid(cards)


def remarks(verdict: Mapping[str, Any]) -> str:
    """Return notes on timing and sensors, effects that are not observable, and the next experiment."""
    parts = []
    if verdict["notes"]:
        parts.append(f"<h3>Timing, sensors and models</h3>{bullets(verdict['notes'])}")
    else:
        parts.append("<h3>Timing and sensors</h3><p>Nothing that could be taken for physics was found.</p>")
    if verdict["not_observable"]:
        items = [
            f"axis {entry['axis']}, {entry['why']}: {', '.join(map(display_name, entry['effects']))}"
            for entry in verdict["not_observable"]
        ]
        parts.append(f"<h3>Not observable with these sensors</h3>{bullets(items)}")
    if verdict["next_experiment"]:
        parts.append(f"<h3>The next experiment</h3><p>{escape(next_experiment_text(verdict))}</p>")
    return section("Sensors and limits", *parts)


def _gain(gain: float) -> str:
    """Return a share of the squared residual as the increase of the RMS without the effect."""
    if gain <= 0.0:
        return "Held-out blocks do not gain by it."
    more = 100.0 * ((1.0 - min(gain, 0.9999)) ** -0.5 - 1.0)
    return f"Without it the error on held-out blocks is {more:.0f} % larger."


def _coordinate(entry: Mapping[str, Any]) -> str:
    name = {"constant": "everywhere", "direction": "direction of motion"}.get(
        entry["coordinate"], display_name(entry["coordinate"])
    )
    if entry.get("label") and entry["coordinate"] == "order":
        return f"{name}: {entry['label']}"
    return f"{name}, by direction" if entry.get("by_direction") and name != "direction of motion" else name


def _range(entry: Mapping[str, Any]) -> str:
    """Return `12.3 to 18.0 mm`, the name of a phase, or the size of a level."""
    unit = entry.get("peak_unit", "N" if entry["sensor"] == "force" else "m")
    peak = entry.get("peak")
    size = quantity(peak, unit) if peak is not None else ""
    if entry["coordinate"] in {"constant", "direction"} or "range" not in entry:
        return size
    low, high = entry["range"]
    if entry["coordinate"] in {"order", "frequency"}:
        return f"{entry['at']:.4g} {entry['unit']}, amplitude {size}"
    if entry.get("label"):
        return f"{entry['label']}, {size}"
    factor, name = display_unit(entry["unit"], max(abs(low), abs(high)))
    return f"{low / factor:.3g} to {high / factor:.3g} {name}, up to {size}"
