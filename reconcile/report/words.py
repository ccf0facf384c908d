"""Verdicts as text: the sentence with its advice, quantities in readable units, display names."""

import math
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, NamedTuple

from kernels.readable_units import display_unit
from reconcile.formats.rotary_units import unit_of

CHANNEL_NAMES = {"force": "motor force", "deviation": "scale less motor"}
"""Residual channel of a verdict -> display name."""


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
    value, low, high = (float(one) / factor for one in (parameter["value"], *parameter["ci95"]))
    if low == high:
        return f"{value:.3g} {name}".rstrip()
    size, width = max(abs(low), abs(high)), abs(high - low)
    digits = min(max(math.ceil(math.log10(size / width)) + 1, 3), 6)  # enough to tell both ends apart
    middle = f"{value:.{digits}g} {name}".rstrip()
    return f"{middle} ({low:.{digits}g} to {high:.{digits}g})"


def parameter_names(parameters: Mapping[str, Mapping[str, Any]]) -> dict[str, str]:
    """Return display names by key: `play_m` is play; equal names also get their quantity."""
    names = {key: _stem(key) for key in parameters}
    often = [name for name in names.values() if list(names.values()).count(name) > 1]
    kinds = {"N": "force", "m/s": "speed", "m": "distance", "s": "time"}
    kinds |= {unit_of(unit, rotary=True): kind for unit, kind in kinds.items()}
    return {
        key: f"{name} {kinds.get(parameters[key]['unit'], '')}".rstrip() if name in often else name
        for key, name in names.items()
    }


def _stem(key: str) -> str:
    for end in ("_n_s2_m2", "_n_s_m", "_m_s", "_n_m", "_m_n", "_rad", "_hz", "_n", "_m", "_s"):
        stem = key.removesuffix(end)
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
    word, findings = verdict["verdict"], verdict["findings"]
    if word == "effects":
        known = dict.fromkeys((f["effect"], f["axis"]) for f in findings if f["effect"] != "unknown")
        count = "one effect" if len(known) == 1 else f"{len(known)} effects"
        named = join_words(f"{display_name(effect)} on axis {axis}" for effect, axis in known)
        sentence = f"The model leaves out {count}: {named}."
        if len(known) < len({(f["effect"], f["axis"]) for f in findings}):
            sentence += " Beside that is something real that no effect of the catalogue explains."
        doubtful = [f for f in findings if f["equivalent"]]
        advice = ""
        if doubtful:
            alike = join_words(display_name(name) for name in doubtful[0]["equivalent"])
            advice = f"{display_name(doubtful[0]['effect']).capitalize()} could also be {alike}: see there."
    elif word == "parameters":
        sentence, advice = "The physics of the model is right; only its values are off.", ""
    elif word == "consistent":
        sentence = "Model and recordings agree: the residual is noise, or less than matters."
        if any(remaining_sentences(verdict)):
            sentence = "Model and recordings agree: the residual cannot be told from noise."
        advice = "Nothing needs to be done; model.toml is the model as it was, made complete."
    else:
        sentence = "The recordings hold something real that no effect of the catalogue explains."
        where = join_words(
            f"the {display_name(entry['coordinate'])} (axis {entry['axis']})"
            for entry in verdict["located"][:2]
        )
        advice = f"Look at it over {where or 'the run time'}."
    parts = [*proof_sentences(verdict), *remaining_sentences(verdict), advice]
    if not verdict.get("proof") and word in {"effects", "parameters"}:
        improved = join_words(_improvements(verdict["fit"])) or "nothing that was held out"
        parts.insert(0, f"Use model.toml: on blocks that it was not fitted to {improved}.")
    if verdict.get("next_experiment"):
        parts.append("The experiment that would decide more is described below.")
    return Headline(sentence, " ".join(part for part in parts if part))


def proof_sentences(verdict: Mapping[str, Any]) -> Iterator[str]:
    """Yield sentences on the errors of the written model on held-out recordings, beside a rigid model."""
    for axis, proofs in verdict.get("proof", {}).items():
        for proof in proofs:
            if not proof["parts"] or not proof["rigid"]:
                continue
            factor, unit = display_unit(proof["unit"], proof["rigid"])
            what = f"{CHANNEL_NAMES[proof['channel']]} of axis {axis}"
            errors = f"{proof['written'] / factor:.3g} {unit} RMS"
            rigid = f"{proof['rigid'] / factor:.3g} {unit}"
            out = "Its last third" if proof["left_out"] == "the last third" else "Each recording"
            if proof["improves"]:
                yield (
                    f"{out} left out, model.toml, made from the rest and loaded again, leaves {errors} in "
                    f"the {what}; a rigid model fitted anew leaves {rigid}."
                )
            elif proof["channel"] == "force" and verdict["verdict"] != "consistent":
                yield (
                    f"{out} left out, nothing that was found predicts the {what} better than a rigid model "
                    f"fitted anew ({rigid} RMS), so model.toml holds that."
                )


def remaining_sentences(verdict: Mapping[str, Any]) -> Iterator[str]:
    """Yield sentences on the unexplained force of each axis where it exceeds the noise and what matters."""
    for axis, of_axis in verdict.get("accounted", {}).items():
        sizes = of_axis.get("force")
        if sizes and not sizes["is_noise"]:
            part = sizes["parts"]["unexplained"]
            left, floors = quantity(part["rms"], sizes["unit"]), f"{sizes['unexplained_floors']:.2g}"
            share = percent(part["share"])
            yield (
                f"On axis {axis} {left} RMS remain unexplained, {floors} noise floors and {share} of the "
                "force's square."
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
        f"{display_name(one['effect'])} (axis {one['axis']}, confidence {percent(one['confidence'])}, "
        f"worth {percent(max(one['heldout_gain'], 0.0))})"
        for one in verdict["minor"]
    ]
    return f"Found, but too small or too doubtful to be named: {join_words(names)}." if names else ""


def _improvements(fit: Mapping[str, Any]) -> list[str]:
    texts = []
    for axis, channel, levels in residual_levels(fit):
        before, after = levels["before"]["heldout"], levels["after"]["heldout"]
        if before > 0.0 and after < 0.98 * before:
            factor, unit = display_unit(levels["unit"], before)
            texts.append(
                f"the error in {CHANNEL_NAMES[channel]} of axis {axis} falls from "
                f"{before / factor:.3g} to {after / factor:.3g} {unit} RMS"
            )
    return texts


def join_words(texts: Iterable[str]) -> str:
    """Join texts to `a, b and c`."""
    given = list(texts)
    return " and ".join([", ".join(given[:-1]), given[-1]] if len(given) > 1 else given)


def capitalised(sentence: str) -> str:
    """Return a sentence with a capital first letter, the others as they are."""
    return sentence[:1].upper() + sentence[1:]
