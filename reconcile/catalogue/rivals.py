"""What tells two effects apart, from the confusions that the entries declare."""

from reconcile.catalogue.entry import Rival
from reconcile.catalogue.registry import CATALOGUE


def confused_with(effect: str) -> list[str]:
    """What an effect is often mistaken for: by its own entry, then by those of the others."""
    own = [rival.effect for rival in CATALOGUE[effect].rivals] if effect in CATALOGUE else []
    others = [name for name, entry in CATALOGUE.items() if effect in {rival.effect for rival in entry.rivals}]
    return [*dict.fromkeys([*own, *others])]


def told_apart(one: str, other: str) -> str:
    """What tells two effects apart; empty where nothing is known of either."""
    words = [rival.told_apart_by for rival in _between(one, other)]
    words += [CATALOGUE[name].shown_by for name in (one, other) if name in CATALOGUE]
    return next((text for text in words if text), "")


def takes_more(one: str, other: str) -> str:
    """The experiment by hand that it takes to tell them apart; empty where a motion does."""
    return next((rival.experiment for rival in _between(one, other) if rival.experiment), "")


def _between(one: str, other: str) -> list[Rival]:
    """What the entry of either says of the other."""
    pairs = ((one, other), (other, one))
    return [
        r for name, rival in pairs if name in CATALOGUE for r in CATALOGUE[name].rivals if r.effect == rival
    ]
