"""Verdicts as text: the sentence with its advice, quantities in readable units, display names."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from kernels.readable_units import display_unit
from reconcile.formats.rotary_units import unit_of

CHANNEL_NAMES = {"force": "motor force", "deviation": "scale less motor"}
"""Display name of a residual channel, by its name in a verdict."""
LEAST_IMPROVED_RATIO = 0.98
"""RMS error over that of the nominal model, below which an improvement is reported; chosen."""


class Headline(NamedTuple):
    """A verdict in one sentence, and advice."""

    sentence: str
    advice: str


def display_name(name: str) -> str:
    """Return the name of an effect or coordinate as words: `drive_compliance` is drive compliance."""
    return name.replace("_", " ").replace("stribeck", "Stribeck")


def quantity(value: float, unit: str) -> str:
    """Format an SI value with three digits and its readable unit."""
    factor, name = display_unit(unit, value)
    return f"{value / factor:.3g} {name}".rstrip()


def interval(parameter: Mapping[str, Any]) -> str:
    """Format a parameter of a verdict with its 95 % interval: `3.02 µm (2.95 to 3.10)`."""
    factor, name = display_unit(parameter["unit"], parameter["value"])
    value, low, high = (float(number) / factor for number in (parameter["value"], *parameter["ci95"]))
    if low == high:
        return f"{value:.3g} {name}".rstrip()
    size, width = max(abs(low), abs(high)), abs(high - low)
    digits = min(max(math.ceil(math.log10(size / width)) + 1, 3), 6)  # enough to tell both ends apart
    middle = f"{value:.{digits}g} {name}".rstrip()
    return f"{middle} ({low:.{digits}g} to {high:.{digits}g})"


def parameter_names(parameters: Mapping[str, Mapping[str, Any]]) -> dict[str, str]:
    """Return display names by key: `play_m` is play; equal names also get their quantity."""
    names = {key: _name_without_unit(key) for key in parameters}
    repeated = [name for name in names.values() if list(names.values()).count(name) > 1]
    quantities = {"N": "force", "m/s": "speed", "m": "distance", "s": "time"}
    quantities |= {unit_of(unit, rotary=True): name for unit, name in quantities.items()}
    return {
        key: f"{name} {quantities.get(parameters[key]['unit'], '')}".rstrip() if name in repeated else name
        for key, name in names.items()
    }


def _name_without_unit(key: str) -> str:
    for suffix in ("_n_s2_m2", "_n_s_m", "_m_s", "_n_m", "_m_n", "_rad", "_hz", "_n", "_m", "_s"):
        stem = key.removesuffix(suffix)
        if stem != key and stem:
            return display_name(stem)
    return display_name(key)


def percent(share: float) -> str:
    """Format a share of one in per cent; never rounds to 0 or 100 %."""
    if share >= 0.995:
        return "> 99 %"
    return "< 1 %" if 0.0 < share < 0.005 else f"{100.0 * share:.0f} %"


def headline(verdict: Mapping[str, Any]) -> Headline:
    """Summarise the verdict in a sentence, with the proof and the next steps."""
    word = verdict["verdict"]
    conclusion = _conclusion(verdict)
    parts = [*proof_sentences(verdict), *unexplained_sentences(verdict), conclusion.advice]
    if not verdict.get("proof") and word in {"effects", "parameters"}:
        improved = join_words(_improvements(verdict["fit"])) or "nothing that was held out"
        parts.insert(0, f"Use model.toml: on blocks that it was not fitted to {improved}.")
    if verdict.get("next_experiment"):
        parts.append("The experiment that would decide more is described below.")
    return Headline(conclusion.sentence, " ".join(part for part in parts if part))


def _conclusion(verdict: Mapping[str, Any]) -> Headline:
    """Return the verdict in a sentence, and the advice that follows from its word alone."""
    match verdict["verdict"]:
        case "effects":
            return _effects_conclusion(verdict["findings"])
        case "parameters":
            return Headline("The physics of the model is right; only its values are off.", "")
        case "consistent":
            sentence = "Model and recordings agree: the residual is noise, or negligible."
            if any(unexplained_sentences(verdict)):
                sentence = "Model and recordings agree: the residual cannot be told from noise."
            advice = "Nothing needs to be done; model.toml is the model as it was, made complete."
            return Headline(sentence, advice)
    where = join_words(
        f"the {display_name(entry['coordinate'])} (axis {entry['axis']})" for entry in verdict["located"][:2]
    )
    sentence = "The recordings hold something real that no effect of the catalogue explains."
    return Headline(sentence, f"Look at it over {where or 'the run time'}.")


def _effects_conclusion(findings: Sequence[Mapping[str, Any]]) -> Headline:
    """Return the named effects in a sentence; advice if the first of them has an equivalent."""
    named = dict.fromkeys((f["effect"], f["axis"]) for f in findings if f["effect"] != "unknown")
    count = "one effect" if len(named) == 1 else f"{len(named)} effects"
    effects = join_words(f"{display_name(effect)} on axis {axis}" for effect, axis in named)
    sentence = f"The model leaves out {count}: {effects}."
    if len(named) < len({(f["effect"], f["axis"]) for f in findings}):
        sentence += " Beside that is something real that no effect of the catalogue explains."
    ambiguous = next((f for f in findings if f["equivalent"]), None)
    if ambiguous is None:
        return Headline(sentence, "")
    equivalent = join_words(display_name(name) for name in ambiguous["equivalent"])
    effect = display_name(ambiguous["effect"]).capitalize()
    return Headline(sentence, f"{effect} could also be {equivalent}: see there.")


def proof_sentences(verdict: Mapping[str, Any]) -> Iterator[str]:
    """Yield sentences on the errors of the written model on held-out recordings, beside a rigid model."""
    for axis, proofs in verdict.get("proof", {}).items():
        for proof in proofs:
            if not proof["parts"] or not proof["rigid"]:
                continue
            factor, unit = display_unit(proof["unit"], proof["rigid"])
            channel = f"{CHANNEL_NAMES[proof['channel']]} of axis {axis}"
            written = f"{proof['written'] / factor:.3g} {unit} RMS"
            rigid = f"{proof['rigid'] / factor:.3g} {unit}"
            part = "Its last third" if proof["left_out"] == "the last third" else "Each recording"
            if proof["improves"]:
                yield (
                    f"{part} left out, model.toml, made from the rest and loaded again, leaves {written} in "
                    f"the {channel}; a refitted rigid model leaves {rigid}."
                )
            elif proof["channel"] == "force" and verdict["verdict"] != "consistent":
                yield (
                    f"{part} left out, nothing that was found predicts the {channel} better than a refitted "
                    f"rigid model ({rigid} RMS); model.toml leaves {written}."
                )


def unexplained_sentences(verdict: Mapping[str, Any]) -> Iterator[str]:
    """Yield sentences on the unexplained force of each axis where it is neither noise nor negligible."""
    for axis, of_axis in verdict.get("accounted", {}).items():
        sizes = of_axis.get("force")
        if sizes and not sizes["is_noise"]:
            part = sizes["parts"]["unexplained"]
            unexplained, floors = quantity(part["rms"], sizes["unit"]), f"{sizes['unexplained_floors']:.2g}"
            share = percent(part["share"])
            yield (
                f"On axis {axis} {unexplained} RMS remain unexplained, {floors} noise floors and {share} of "
                "the force's square."
            )


def is_rotary(verdict: Mapping[str, Any], axis: str) -> bool:
    """Return whether an axis is rotary."""
    return bool(
        verdict.get("fit", {}).get(axis, {}).get("force", {}).get("unit") == unit_of("N", rotary=True)
    )


def residual_levels(fit: Mapping[str, Any]) -> Iterator[tuple[str, str, Mapping[str, Any]]]:
    """Yield axis, channel and RMS levels of every residual in the `fit` of a verdict."""
    for axis, of_axis in fit.items():
        for channel in CHANNEL_NAMES:
            if channel in of_axis:
                yield axis, channel, of_axis[channel]


def minor_effects(verdict: Mapping[str, Any]) -> str:
    """Return what was found and is not among the findings, in one line; empty without any."""
    names = [
        f"{display_name(minor['effect'])} (axis {minor['axis']}, confidence {percent(minor['confidence'])}, "
        f"worth {percent(max(minor['heldout_gain'], 0.0))})"
        for minor in verdict["minor"]
    ]
    return f"Found, but too small or too doubtful to be named: {join_words(names)}." if names else ""


def _improvements(fit: Mapping[str, Any]) -> list[str]:
    texts = []
    for axis, channel, levels in residual_levels(fit):
        nominal, improved = levels["before"]["heldout"], levels["after"]["heldout"]
        if nominal > 0.0 and improved < LEAST_IMPROVED_RATIO * nominal:
            factor, unit = display_unit(levels["unit"], nominal)
            texts.append(
                f"the error in {CHANNEL_NAMES[channel]} of axis {axis} falls from "
                f"{nominal / factor:.3g} to {improved / factor:.3g} {unit} RMS"
            )
    return texts


def join_words(texts: Iterable[str]) -> str:
    """Join texts to `a, b and c`."""
    words = list(texts)
    return " and ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)


def capitalised(sentence: str) -> str:
    """Return a sentence with a capital first letter, the others as they are."""
    return sentence[:1].upper() + sentence[1:]
