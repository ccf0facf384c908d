"""Every command that a page shows is one that its program takes: parsed by the program, without being run.

What runs them as they are shown is in commands_of_pages.toml (test_commands_run.py). RUN_BY has what tests
each kind of command in full: one of which no test runs its kind is refused.
"""

import pytest
import typer.main
from command_parsing import PROGRAMS, parse
from page_commands import ROOT, Shown, shown

RUN_BY = {
    "servo-ctrl run": "tests/docs/test_readme.py",
    "servo-ctrl learn": "tests/hil/test_learning_lockstep.py",
    "servo-ctrl tune": "tests/unit/servo_tuning/test_session.py",
    "servo-ctrl check": "tests/docs/test_tutorials.py",
    "servo-ctrl export": "tests/docs/test_tutorials.py",
    "servo-ctrl report": "tests/docs/test_tutorials.py",
    "servo-ctrl demo": "tests/hil/test_experiments.py",
    "servo-ctrl ask": "tests/hil/test_ask.py",
    "servo-ctrl new-machine": "tests/docs/test_tutorials.py",
    "servo-ctrl nodes": "tests/docs/test_tutorials.py",
    "servo-ctrl conformance": "tests/docs/test_tutorials.py",
    "servo-ctrl learned": "tests/unit/servo_cli/test_learned_commands.py",
    "servo-ctrl experiment friction": "tests/hil/test_friction_experiments.py",
    "servo-ctrl experiment drift": "tests/hil/test_friction_experiments.py",
    "servo-ctrl experiment fuzzy": "tests/hil/test_fuzzy_experiment.py",
    "servo-ctrl experiment positioning": "tests/hil/test_positioning_experiment.py",
    "servo-ctrl experiment compensations": "tests/unit/studies/test_compensations.py",
    "servo-ctrl experiment circles": "tests/hil/test_experiments.py",
    "servo-ctrl experiment emps": "tests/hil/test_experiments.py",
    "hil-sim run": "tests/docs/test_readme.py",
    "reconcile diagnose": "tests/docs/test_tutorials.py",
    "reconcile example": "tests/unit/reconcile/examples",
    "reconcile loop": "tests/hil/test_reconcile_loop.py",
    "reconcile watch": "tests/unit/reconcile/watch",
    "reconcile fleet": "tests/unit/reconcile/fleet",
    "reconcile trial": "tests/unit/reconcile/trials",
}
"""By the beginning of a command: the test, or the folder of tests, that runs such a one."""


COMMANDS = shown()


def test_the_pages_show_commands_of_all_programs() -> None:
    assert {one.words[0] for one in COMMANDS} == set(PROGRAMS)
    assert len(COMMANDS) > 50


@pytest.mark.parametrize("one", COMMANDS, ids=lambda one: f"{one.page.name}: {one.line}"[:80])
def test_a_command_of_a_page_is_taken(one: Shown, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    parse(one.words)
    assert [kind for kind in RUN_BY if one.line.startswith(f"{kind} ")], "no test runs such a command"


def test_a_wrong_command_is_refused() -> None:
    for wrong in ("servo-ctrl rnu", "servo-ctrl run --machin x", "reconcile example emsp --out x"):
        with pytest.raises((AssertionError, typer._click.exceptions.UsageError)):
            parse(wrong.split())


def test_a_claim_that_runs_a_command_names_it() -> None:
    for kind, where in RUN_BY.items():
        place = ROOT / where
        files = [place] if place.is_file() else sorted(place.rglob("*.py"))
        tutorials = sorted((ROOT / "docs" / "tutorials").glob("*.md")) if "tutorials" in where else []
        text = "\n".join(file.read_text(encoding="utf-8") for file in [*files, *tutorials])
        last = kind.split()[-1]
        assert files, where
        assert last in text, f"{where} does not name {last}"
