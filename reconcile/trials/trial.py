"""Run blind trials: generate a case, seal its truth, diagnose it, open the truth and score the verdict."""

import hashlib
import json
import multiprocessing
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from types import ModuleType
from typing import Any, NamedTuple

from reconcile.diagnosis.diagnose import diagnose
from reconcile.errors import ReconcileError
from reconcile.trials.achievable import achieved
from reconcile.trials.score import score

SEALED = "sealed"
"""Folder of a case that is hashed before the diagnosis, and read only after it."""


class Seal(NamedTuple):
    """A generated case with the hash of its unread truth."""

    seed: int
    directory: Path
    recordings: list[Path]
    sha256: str


def generator_of(name: str) -> ModuleType:
    """Import the module that draws and records cases. Raises ReconcileError."""
    try:
        module = import_module(name)
    except ImportError as error:
        remedy = "run it in the project's directory, or name another one with --generator"
        raise ReconcileError(name, "", f"cannot be loaded: {error}", remedy) from None
    if not (callable(getattr(module, "draw", None)) and callable(getattr(module, "record", None))):
        raise ReconcileError(name, "", "is not a generator of cases: it has no draw() and record()")
    return module


def claimed(generator: str, first: int, cases: int) -> bool:
    """Note with the generator which seeds are looked at now; return if they are proof. Raises ReconcileError.

    A generator without `claim(first, count)` keeps no list, and nothing of it is proof.
    """
    claim = getattr(generator_of(generator), "claim", None)
    try:
        return bool(claim(first, cases)) if claim else False
    except ValueError as error:
        raise ReconcileError(generator, "", str(error), "choose fresh seeds with --seed") from None


def name_of(tool: str) -> str:
    """Return the name of another tool from its module. Raises ReconcileError."""
    try:
        return str(import_module(tool).NAME)
    except (ImportError, AttributeError) as error:
        remedy = "run it in the project's directory; it needs NAME and answer(recordings, model_file)"
        raise ReconcileError(tool, "", f"cannot be asked beside: {error}", remedy) from None


def make(generator: str, seed: int, directory: Path) -> Seal:
    """Draw and record the case of a seed, and seal its truth."""
    module = generator_of(generator)
    recordings = module.record(module.draw(seed), directory)
    digest = hashlib.sha256()
    for file in sorted((directory / SEALED).iterdir()):
        digest.update(file.name.encode() + b"\0" + file.read_bytes())
    return Seal(seed, directory, recordings, digest.hexdigest())


def judge(seal: Seal, beside: str | None = None) -> dict[str, Any]:
    """Diagnose a case, then open its truth and score it; a failed diagnosis is scored as such.

    `beside` names the module of another tool that gets the same files and is scored by the same rule.
    """
    started = time.perf_counter()
    try:
        model, out = seal.directory / "model.toml", seal.directory / "out"
        found = diagnose(seal.recordings, model, out, with_report=False, with_next=False, with_proof=False)
    except Exception as error:  # noqa: BLE001  # one case that fails is a result, not the end of the trials
        content: dict[str, Any] = {
            "verdict": "failed",
            "findings": [],
            "error": f"{type(error).__name__}: {error}",
        }
        explanations = {}
    else:
        content, explanations = found.verdict, found.explanations
    seconds = time.perf_counter() - started
    truth = json.loads((seal.directory / SEALED / "truth.json").read_text(encoding="utf-8"))
    row = score(truth, content)
    row["achieved"] = achieved(explanations.get("x", []), seal.directory / SEALED)
    if beside is not None:
        row["beside"] = _score_other_tool(beside, seal, truth, row["achieved"])
    return {"seed": seal.seed, "sha256": seal.sha256, "seconds": seconds, **row}


def _score_other_tool(
    name: str, seal: Seal, truth: dict[str, Any], achievable: dict[str, dict[str, Any]]
) -> dict[str, Any]:
    """Return the row of another tool; its share of the refitted RMS is compared with the same floor."""
    started = time.perf_counter()
    try:
        answer = import_module(name).answer(seal.recordings, seal.directory / "model.toml")
    except Exception as error:  # noqa: BLE001  # as above
        answer = {
            "verdict": "failed",
            "findings": [],
            "error": f"{type(error).__name__}: {error}",
            "left": {},
        }
    seconds = time.perf_counter() - started
    gains = {}
    for channel, of in achievable.items():
        after = of["before"] * answer["left"].get("x", {}).get(channel, 1.0)
        possible = of["before"] ** 2 - of["floor"] ** 2
        gained = of["before"] ** 2 - after**2
        gains[channel] = {**of, "after": after, "share": None if of["share"] is None else gained / possible}
    return {"seconds": seconds, **score(truth, answer), "achieved": gains}


def trials(
    seeds: Sequence[int],
    generator: str,
    processes: int,
    on_sealed: Callable[[Seal], None],
    keep: Path | None = None,
    beside: str | None = None,
) -> Iterator[dict[str, Any]]:
    """Yield rows in the order of the seeds; `on_sealed` receives each case before it is diagnosed."""
    generator_of(generator)
    context = multiprocessing.get_context("forkserver")
    with TemporaryDirectory() as temporary, ProcessPoolExecutor(processes, mp_context=context) as pool:
        place = keep or Path(temporary)
        ahead = 2 * processes
        pending: list[Any] = []
        for index in range(len(seeds) + ahead):
            if index < len(seeds):
                directory = place / str(seeds[index])
                seal = pool.submit(make, generator, seeds[index], directory).result()
                on_sealed(seal)
                pending.append(pool.submit(judge, seal, beside))
            if len(pending) >= ahead or (index >= len(seeds) and pending):
                yield pending.pop(0).result()
