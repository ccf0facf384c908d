"""The packages that a user gets with ours, as they are installed here, and what their licences allow."""

import re
from importlib.metadata import Distribution, distribution
from typing import NamedTuple

from packaging.requirements import Requirement

OURS = "servo-ctrl"
EXTRAS = ("fleet", "hmi", "mdf4")
PERMISSIVE = re.compile(
    r"MIT|BSD|Apache|ISC|PSF|Python Software Foundation|Zlib|CC0|0BSD|Kiwi|MPL|Mozilla|matplotlib|LLVM"
)
"""Words of licences that ask for a notice; MPL asks for changes of its own files too, and we change none."""
EXCEPTIONS = {
    "asammdf": "LGPL-3.0-or-later: imported as a library, unchanged, and only with [mdf4]",
    "python-can": "LGPL-3.0-only: imported as a library, unchanged",
    "docutils": "public domain, BSD and, for one file that nobody here loads, GPL",
    "paho-mqtt": "EPL-2.0 or BSD-3-Clause: taken under BSD-3-Clause",
}
"""Packages whose licence was read, and why it is fine."""


class Package(NamedTuple):
    """An installed package."""

    name: str
    version: str
    licence: str
    needs: tuple[str, ...]
    """Names of those that it brings."""


def canonical(name: str) -> str:
    """Return a name as packages are compared."""
    return re.sub(r"[-_.]+", "-", name).lower()


def brought(extras: tuple[str, ...] = EXTRAS) -> dict[str, Package]:
    """Return all packages that an installation with `extras` brings, ours first, by canonical name."""
    found: dict[str, Package] = {}
    waiting = [(OURS, frozenset(extras))]
    asked: set[tuple[str, frozenset[str]]] = set()
    while waiting:
        name, wanted = waiting.pop()
        if (name, wanted) in asked:
            continue
        asked.add((name, wanted))
        one = distribution(name)
        needs = [
            requirement
            for requirement in map(Requirement, one.requires or ())
            if requirement.marker is None
            or any(requirement.marker.evaluate({"extra": extra}) for extra in wanted | {""})
        ]
        names = {canonical(need.name) for need in needs} | set(found[name].needs if name in found else ())
        found[name] = Package(name, one.version, licence_of(one), tuple(sorted(names)))
        waiting += [(canonical(need.name), frozenset(need.extras)) for need in needs]
    return found


def licence_of(one: Distribution) -> str:
    """Return the expression, else the classifiers, else the first line of the free text."""
    metadata = one.metadata
    if expression := metadata.get("License-Expression"):
        return str(expression)
    marks = [text for text in metadata.get_all("Classifier", []) if text.startswith("License ::")]
    named = [mark.rpartition(" :: ")[2] for mark in marks if mark.count("::") > 1]
    free = str(metadata.get("License") or "").strip().splitlines()
    return ", ".join(named) or (free[0] if free else "")


def refused(packages: dict[str, Package]) -> dict[str, str]:
    """Return the licence by name of the packages that nobody has allowed."""
    return {
        name: one.licence or "none is stated"
        for name, one in packages.items()
        if name not in {OURS, *EXCEPTIONS} and not allowed(one.licence)
    }


def allowed(licence: str) -> bool:
    """Whether every part of a licence is permissive; with OR one part is enough."""
    choices = re.split(r"\bOR\b", re.sub(r"[()]", "", licence))
    return any(
        all(PERMISSIVE.search(part) and "GPL" not in part for part in re.split(r"\bAND\b|,", choice))
        for choice in choices
    )
