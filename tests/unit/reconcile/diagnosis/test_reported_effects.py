"""What is reported of a model in whose place another one is written."""

from reconcile.catalogue.kinds import ResidualChannel
from reconcile.diagnosis.axis_diagnosis import as_reported
from reconcile.identification.explain import Explanation, ResidualRms
from reconcile.identification.findings import IdentifiedEffect

RMS = ResidualRms(1.0, 1.0)


def effect(name: str) -> IdentifiedEffect:
    return IdentifiedEffect(name, "force", 0.9, [], [], [], {}, 0.6, 0.5, "", 0.5)


def explanation(findings: str, minor: str) -> Explanation:
    found, small = [effect(n) for n in findings.split()], [effect(n) for n in minor.split()]
    return Explanation(ResidualChannel.FORCE, found, small, RMS, RMS, RMS, {}, None, 0.0, False, [])


def reported(written: Explanation, identified: Explanation) -> tuple[set[str], set[str]]:
    both = as_reported(written, identified)
    return {f.effect for f in both.findings}, {f.effect for f in both.minor}


def test_an_effect_that_was_minor_where_it_was_identified_stays_minor() -> None:
    written = explanation("gravity amplifier_dead_zone stribeck_friction", "constant_force")
    identified = explanation("gravity", "amplifier_dead_zone")
    assert reported(written, identified) == (
        {"gravity"},
        {"amplifier_dead_zone", "stribeck_friction", "constant_force"},
    )


def test_a_finding_that_the_written_model_lacks_is_reported_and_one_that_is_small_in_it_is_minor() -> None:
    assert reported(explanation("", "gravity"), explanation("gravity cogging", "")) == (
        {"cogging"},
        {"gravity"},
    )


def test_what_nothing_explains_is_that_of_the_written_model() -> None:
    assert reported(explanation("unknown", ""), explanation("", "")) == ({"unknown"}, set())
