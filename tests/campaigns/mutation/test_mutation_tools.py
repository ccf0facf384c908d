"""The mutation tools: operators do what they say and nothing else, mutants are Python, copies are apart."""

import pytest

pytest.importorskip("cosmic_ray", reason="only `make mutation` installs Cosmic Ray")

from pathlib import Path

from cosmic_ray.mutating import mutate_code
from cosmic_ray.operators.operator import Operator

from tests.campaigns.mutation.explained import ENTRY
from tests.campaigns.mutation.mutation_main import Known, change_of, mutants
from tests.campaigns.mutation.sandbox import KILLED, SURVIVED, TIMED_OUT
from tests.campaigns.mutation.table_operators import RemoveEntry, ReplaceEnumMember, ReplaceName
from tests.campaigns.mutation.targets import REPOSITORY, TARGETS, Mutant, enum_members


@pytest.mark.parametrize("kind", [RemoveEntry, ReplaceEnumMember, ReplaceName])
def test_mutation_operators_reproduce_their_examples(kind: type[Operator]) -> None:
    for example in kind.examples():
        operator = kind(**(example.operator_args or {}))
        changed = mutate_code(example.pre_mutation_code, operator, example.occurrence)
        assert changed in {example.post_mutation_code, None}
        assert (changed is None) == (example.pre_mutation_code == example.post_mutation_code)


def test_comprehensions_and_plain_names_have_no_entries() -> None:
    for code in ("x = [y for y in z]", "x = {a: b for a, b in z}", "x = y", "x = ()"):
        assert mutate_code(code, RemoveEntry(), 0) is None


def test_members_of_enums_are_found_and_nothing_else() -> None:
    source = "class A(Enum):\n    ONE = 1\n    def f(self): pass\n    TWO = 2\nclass B:\n    ONE = 1\n"
    assert enum_members(source) == {"A": ["ONE", "TWO"]}


def test_mutants_of_a_file_differ_from_it_and_from_one_another() -> None:
    target = next(target for target in TARGETS if target.file.endswith("control/limits.py"))
    found = list(mutants(target))
    sources = {mutant.source for mutant in found}
    assert len(sources) == len(found) >= 4
    assert (REPOSITORY / target.file).read_text(encoding="utf-8") not in sources
    assert any("limit), limit)" in change_of(target, mutant) for mutant in found)


def test_every_named_file_exists() -> None:
    for target in TARGETS:
        for name in (target.file, *target.tests, *target.documents):
            assert (REPOSITORY / name.partition("::")[0]).is_file(), name


def test_killed_mutants_are_remembered_and_surviving_ones_are_run_again(tmp_path: Path) -> None:
    known = Known(tmp_path / "killed.jsonl")
    killed, survived, slow = (Mutant("f.py", "Op", number, f"x = {number}\n") for number in range(3))
    known.add(killed, KILLED)
    known.add(survived, SURVIVED)
    known.add(slow, TIMED_OUT)
    again = Known(tmp_path / "killed.jsonl")
    assert [again.outcome(each) for each in (killed, survived, slow)] == [KILLED, "", TIMED_OUT]


def test_page_is_read_by_file_and_change() -> None:
    page = "### `a/b.py`\n\n```diff\n-x = 1\n+x = 2\n```\n\nNobody reads x.\nStill not.\n\n### `c.py`\n"
    (found,) = ENTRY.finditer(page)
    assert (found["file"], found["change"], found["reason"]) == (
        *("a/b.py", "-x = 1\n+x = 2"),
        "Nobody reads x.\nStill not.",
    )
