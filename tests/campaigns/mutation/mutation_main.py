"""`make mutation`: are the tests of fault policy, drive states and limits able to fail?

Run as `python -m tests.campaigns.mutation.mutation_main --json mutation.json [--only
servo_ctrl/control/limits.py]`. Each mutant is one change of one file, made by Cosmic Ray's operators and by
ours for tables; the tests about that file run against it. Survivors are explained in docs/mutation.md, or are
holes.
"""

import ast
import difflib
import hashlib
import json
import time
from collections import Counter
from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer
from cosmic_ray.mutating import mutate_code
from rich.console import Console
from rich.table import Table

from tests.campaigns.mutation.explained import explanation_of
from tests.campaigns.mutation.sandbox import KILLED, SURVIVED, copy_sources, load_libraries, outcome
from tests.campaigns.mutation.targets import REPOSITORY, TARGETS, Mutant, Target, operators_of

FOR_THE_TYPE_CHECKER = "if not TYPE_CHECKING"
"""A mutant that is none: it imports what only the type checker needs."""
LIMIT_FACTOR, LEAST_LIMIT_S = 5.0, 20.0
"""A mutant may take so many times as long as the file as it is."""
BY_A_PAGE = "killed by a page alone"
KNOWN_FILE = "killed.jsonl"


class Known:
    """Mutants that were killed before, by their text: more tests bring none of them back to life."""

    def __init__(self, file: Path) -> None:
        self._file = file
        lines = file.read_text(encoding="utf-8").splitlines() if file.exists() else []
        self._outcomes: dict[str, str] = {
            entry["mutant"]: entry["outcome"] for entry in map(json.loads, lines)
        }

    def outcome(self, mutant: Mutant) -> str:
        """What became of it, "" where nobody knows."""
        return self._outcomes.get(self._key(mutant), "")

    def add(self, mutant: Mutant, found: str) -> None:
        """Keep it, unless it has survived: a test that is written later may kill it."""
        if found in {SURVIVED, BY_A_PAGE}:
            return
        with self._file.open("a", encoding="utf-8") as file:
            file.write(json.dumps({"mutant": self._key(mutant), "outcome": found}) + "\n")

    @staticmethod
    def _key(mutant: Mutant) -> str:
        return hashlib.sha256(f"{mutant.file}\n{mutant.source}".encode()).hexdigest()


def mutants(target: Target) -> Iterator[Mutant]:
    """All that is different from the file and from one another, and is Python."""
    source = (REPOSITORY / target.file).read_text(encoding="utf-8")
    seen, meaning = {source}, _without_annotations(source)
    for name, operator in operators_of(target, source):
        occurrence = 0
        while (changed := mutate_code(source, operator, occurrence)) is not None:
            if changed not in seen and FOR_THE_TYPE_CHECKER not in changed and _differs(changed, meaning):
                seen.add(changed)
                yield Mutant(target.file, name, occurrence, changed)
            occurrence += 1


def change_of(target: Target, mutant: Mutant) -> str:
    """The lines that differ, - as it is, + the mutant."""
    source = (REPOSITORY / target.file).read_text(encoding="utf-8")
    lines = difflib.unified_diff(source.splitlines(), mutant.source.splitlines(), n=0, lineterm="")
    return "\n".join(line for line in lines if line[:3] not in {"---", "+++"} and not line.startswith("@@"))


def judge(target: Target, folder: Path, known: Known, progress: Callable[[str], None]) -> dict[str, Any]:
    """All mutants of a file."""
    file = folder / target.file
    original = (REPOSITORY / target.file).read_text(encoding="utf-8")
    baseline, seconds = outcome(folder, target.tests, 600.0, target.documents)
    if baseline != SURVIVED:
        log = (folder / "pytest.log").read_text(encoding="utf-8")
        raise RuntimeError(f"{target.file}: its tests fail without a mutant:\n{log}")
    limit_s = max(LIMIT_FACTOR * seconds, LEAST_LIMIT_S)
    counts: Counter[str] = Counter()
    by_operator: dict[str, Counter[str]] = {}
    survivors = []
    started_s = time.monotonic()
    try:
        for mutant in mutants(target):
            found = known.outcome(mutant)
            if not found:
                file.write_text(mutant.source, encoding="utf-8")
                found, _ = outcome(folder, target.tests, limit_s, target.documents)
                if found == SURVIVED and target.documents:
                    found = BY_A_PAGE if outcome(folder, target.documents, limit_s)[0] == KILLED else SURVIVED
                known.add(mutant, found)
            counts[found] += 1
            by_operator.setdefault(mutant.operator, Counter())[found] += 1
            if found in {SURVIVED, BY_A_PAGE}:
                change = change_of(target, mutant)
                survivors.append(
                    {
                        "operator": mutant.operator,
                        "occurrence": mutant.occurrence,
                        "change": change,
                        "outcome": found,
                        "explanation": explanation_of(target.file, change),
                    }
                )
                progress(f"{target.file}: {found}: {mutant.operator} {mutant.occurrence}\n{change}")
    finally:
        file.write_text(original, encoding="utf-8")
    return {
        "file": target.file,
        "tests": list(target.tests),
        "mutants": counts.total(),
        "outcomes": dict(counts),
        "by_operator": {name: dict(found) for name, found in by_operator.items()},
        "survivors": survivors,
        "seconds": round(time.monotonic() - started_s, 1),
        "tests_take_s": round(seconds, 2),
    }


def _differs(changed: str, meaning: str) -> bool:
    """Whether a text is Python, and means anything else than the file: annotations do nothing."""
    try:
        return _without_annotations(changed) != meaning
    except (SyntaxError, ValueError):
        return False


def _without_annotations(source: str) -> str:
    tree = ast.parse(source)
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef):
            node.returns = None
        elif isinstance(node, ast.arg):
            node.annotation = None
        elif isinstance(node, ast.AnnAssign):
            node.annotation = ast.Constant(None)
    return ast.dump(tree)


def main(
    json_file: Annotated[Path, typer.Option("--json", help="Where the figures go.")],
    only: Annotated[list[str] | None, typer.Option(help="These files; repeatable.")] = None,
    folder: Annotated[Path, typer.Option(help="The copy in which mutants live.")] = Path("out/mutation"),
    fresh: Annotated[bool, typer.Option("--fresh", help="Judge again what was killed before.")] = False,
) -> None:
    """Mutate, print a table, write the JSON file whole. Exit status 1 where a survivor is not explained."""
    console = Console()
    started, start_s = datetime.now(UTC), time.monotonic()
    load_libraries()
    folder = folder.resolve()
    folder.mkdir(parents=True, exist_ok=True)
    copy_sources(REPOSITORY, folder)
    if fresh:
        (folder / KNOWN_FILE).unlink(missing_ok=True)
    known = Known(folder / KNOWN_FILE)
    say = partial(console.print, markup=False, soft_wrap=True)  # an index in brackets is not a colour
    results = [judge(target, folder, known, say) for target in TARGETS if not only or target.file in only]
    open_ones = [
        f"{result['file']}: {survivor['change']}"
        for result in results
        for survivor in result["survivors"]
        if not survivor["explanation"]
    ]
    document = {
        "started": started.isoformat(timespec="seconds"),
        "duration_s": round(time.monotonic() - start_s, 1),
        "files": results,
        "not_explained": open_ones,
    }
    nascent = json_file.with_suffix(".tmp")
    nascent.write_text(json.dumps(document, indent=2) + "\n", encoding="utf-8")
    nascent.replace(json_file)
    table = Table("file", "mutants", "killed", "by a page alone", "survived", "seconds")
    for result in results:
        outcomes = Counter(result["outcomes"])
        left = outcomes[SURVIVED]
        table.add_row(
            result["file"],
            str(result["mutants"]),
            str(result["mutants"] - left - outcomes[BY_A_PAGE]),
            str(outcomes[BY_A_PAGE]),
            str(left),
            str(result["seconds"]),
        )
    console.print(table)
    if open_ones:
        console.print(f"[red]{len(open_ones)} survivors are not explained[/]")
        raise typer.Exit(1)


if __name__ == "__main__":
    typer.run(main)
