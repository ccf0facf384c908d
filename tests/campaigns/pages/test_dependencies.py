"""Every dependency has its reason on docs/dependencies.md, and its cost at the version that is pinned."""

import json

from advisories import canonical, pinned

from tests.campaigns.pages.dependencies import FIGURES, declared, reasons


def test_every_dependency_has_a_reason_and_what_it_would_take_to_leave() -> None:
    assert {name: one["extra"] for name, one in reasons().items()} == declared()
    assert all(one["why"] and one["leave"] for one in reasons().values())


def test_the_costs_are_those_of_the_pinned_versions() -> None:
    versions = {canonical(name): version for name, version in pinned().items()}
    measured = json.loads(FIGURES.read_text(encoding="utf-8"))
    assert {name: one["version"] for name, one in measured.items()} == {
        name: versions[name] for name in reasons()
    }
