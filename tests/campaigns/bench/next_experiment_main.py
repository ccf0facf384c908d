"""How many recordings the next experiment saves against a fixed test programme, on ambiguous concealed cases.

Run as `python -m tests.campaigns.bench.next_experiment_main --json FILE [--first-seed 5000] [--seeds 2]
[--page FILE]`. Each case is a drawn axis (`tests.campaigns.blind`) with one concealed effect, recorded once
in production, for 3 s: a circle on even seeds, moves on odd ones. Effects are those that the catalogue's
column "confused with" speaks of. From that one recording on, both go on until the verdict is right: the next
experiment chooses a motion each time, the fixed programme makes its motions in their order. Both move within
the same limits, and for about as long.

Counted are cases that are ambiguous, which is that the first verdict is not right, and in which the effect
can be seen at all, by the rule of `tests.campaigns.blind.observability`, in the recordings of all the fixed
programme. Right: the effect or its class is named, nothing else stands in its place, no false name and no
`unknown`.
"""

import json
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console

from reconcile.catalogue import registry
from reconcile.catalogue.unnamed_terms import meaning_of
from reconcile.design.candidate_motions import candidate_motions, plan_motion
from reconcile.design.excitations import Excitation
from reconcile.design.limits import ACCELERATION_RISE_S, AxisLimits
from reconcile.diagnosis.diagnose import WrittenDiagnosis, diagnose
from reconcile.errors import ReconcileError
from reconcile.trials.score import score
from tests.campaigns.bench.main import machine_facts, write_whole
from tests.campaigns.bench.next_experiment_page import summary, write_figures
from tests.campaigns.blind.case import Case, SimulatedRecording
from tests.campaigns.blind.draws import WARMED, draw
from tests.campaigns.blind.effects import CATALOGUE
from tests.campaigns.blind.further_recording import record_along
from tests.campaigns.blind.motions import PRODUCTION
from tests.campaigns.blind.observability import judged
from tests.campaigns.blind.recorded import record, simulated, truth

SCORED_FROM = 100_000
"""Seeds from here on are for the blind trials alone."""
RIVALS = {rival.effect for entry in registry.CATALOGUE.values() for rival in entry.rivals}
CONFUSED = RIVALS | {name for name, entry in registry.CATALOGUE.items() if entry.rivals}
EFFECTS = tuple(sorted(CONFUSED & set(CATALOGUE) - WARMED))
FIXED = ("slow speeds", "small strokes", "fast moves", "dwells", "long strokes")
"""The fixed programme, by kinds of motion."""
MOST = len(FIXED)
"""Further recordings of a case."""
FIRST_S = 3.0
"""Duration of the first recording: a stroke or two, a round or two."""
TRAVEL = 0.45
"""Share of the travel that motions may use, to either side of the middle."""


def case_of(seed: int, effect: str) -> Case:
    """An axis with one concealed effect that was recorded once, in production."""
    case = draw(seed, None, (effect,))
    once = case.runs[0]._replace(motion=PRODUCTION[seed % 2], duration_s=FIRST_S)
    return case._replace(runs=(once,))


def limits_from_machine(case: Case) -> AxisLimits:
    """What the machine may do."""
    reach = case.reach
    end_m = TRAVEL * reach.travel_m
    hard = reach.acceleration_m_s2
    return AxisLimits(-end_m, end_m, reach.velocity_m_s, hard, hard / ACCELERATION_RISE_S, 0.0)


def fixed_programme(case: Case, limits: AxisLimits) -> list[Excitation]:
    """Of several motions of a kind the middle one."""
    motions = [
        one.motion
        for one in candidate_motions(limits, case.sensing.period_s, 1e-4, 4.0 * case.plant.motor_count_m)
    ]
    kinds = [[one for one in motions if one.kind == kind] for kind in FIXED]
    return [own[len(own) // 2] for own in kinds if own]


def is_right(case: Case, recordings: Sequence[SimulatedRecording], verdict: dict[str, Any]) -> bool:
    """The effect is named, uncontested, and nothing else is."""
    sealed = json.loads(json.dumps(truth(case, [recordings[0]])))
    for effect in sealed["effects"]:
        effect["observable"] = True
        effect["rms"] = effect["rms"] or 0.0  # none where the first recording does not show it
        effect["also"] = [*effect["also"], "payload_mass"]  # the model's mass is that of the first recording
    row = score(sealed, verdict)
    (effect,) = sealed["effects"]
    if effect["name"] not in row["found"] or row["false"] or row["called_unknown"]:
        return False
    own = {effect["name"], *effect["alike"]}
    for finding in verdict["findings"]:
        if finding["effect"] in own:
            alike = {*meaning_of(finding["effect"]).equivalent, *own}
            return not set(finding["equivalent"]) - alike
    return True  # its class was named


def diagnose_all(
    case: Case,
    recordings: Sequence[SimulatedRecording],
    paths: Sequence[Path],
    directory: Path,
    limits: AxisLimits | None = None,
    kinds: Sequence[str] = (),
) -> tuple[bool, WrittenDiagnosis | None]:
    """Diagnose; return whether the verdict is right, and the diagnosis, None where it fails.

    Without limits no next experiment is designed.
    """
    try:
        found = diagnose(
            paths,
            directory / "model.toml",
            directory / "out",
            with_report=False,
            with_next=limits is not None,
            limits={"x": limits} if limits is not None else None,
            made=kinds,
        )
    except ReconcileError:
        return False, None
    return is_right(case, recordings, found.verdict), found


def named(found: WrittenDiagnosis | None) -> list[str] | None:
    """Return the effects of a verdict's findings; None where there is no verdict."""
    return [finding["effect"] for finding in found.verdict["findings"]] if found else None


def one_case(seed: int, effect: str, directory: Path) -> dict[str, Any]:
    """Go on from one first recording by the next experiments, and by the fixed programme."""
    case, started_s = case_of(seed, effect), time.perf_counter()
    paths, recordings = record(case, directory), [simulated(case, case.runs[0])]
    limits = limits_from_machine(case)
    row: dict[str, Any] = {
        "seed": seed,
        "effect": effect,
        "first": case.runs[0].motion,
        "has_scale": case.sensing.has_scale,
    }
    right, found = diagnose_all(case, recordings, paths, directory, limits)
    row["first_verdict"] = named(found)
    programme = fixed_programme(case, limits)
    recorded = [
        record_along(case, _positions(case, motion, limits), number, directory)
        for number, motion in enumerate(programme, start=1)
    ]
    slow = case.runs[0]._replace(motion="slow")  # of the programme, which has slow constant speeds
    judging = case._replace(runs=(*case.runs, slow))
    seen = judged(judging, [*recordings, *(one for _, one in recorded)])[effect]
    row["observable"], row["why_not"] = seen["observable"], seen["why_not"]
    row["ambiguous"] = not right
    if right or not seen["observable"] or found is None:
        return row
    row["fixed"] = _by_fixed_programme(case, recordings[0], paths[0], recorded, directory)
    row["next"] = _by_next_experiment(case, recordings[0], paths[0], found, directory, limits)
    row["seconds"] = round(time.perf_counter() - started_s, 1)
    return row


def _positions(case: Case, motion: Excitation, limits: AxisLimits) -> np.ndarray[Any, np.dtype[np.float64]]:
    planned = plan_motion(motion, limits, case.control_s)
    assert planned is not None, motion.words
    return planned.position_m


def _by_fixed_programme(
    case: Case,
    first: SimulatedRecording,
    path: Path,
    recorded: Sequence[tuple[Path, SimulatedRecording]],
    directory: Path,
) -> dict[str, Any]:
    """Add the recordings of the fixed programme one by one until the verdict is right."""
    verdicts = []
    for count in range(1, len(recorded) + 1):
        paths = [path, *(one for one, _ in recorded[:count])]
        recordings = [first, *(one for _, one in recorded[:count])]
        right, found = diagnose_all(case, recordings, paths, directory)
        verdicts.append(named(found))
        if right:
            return {"recordings": count, "verdicts": verdicts}
    return {"recordings": None, "verdicts": verdicts}


def _by_next_experiment(
    case: Case,
    first: SimulatedRecording,
    path: Path,
    found: WrittenDiagnosis | None,
    directory: Path,
    limits: AxisLimits,
) -> dict[str, Any]:
    """Add recordings one by one, each the next experiment of the diagnosis of those before it."""
    paths, recordings, kinds, verdicts = [path], [first], [], []
    asked = []
    for count in range(1, MOST + 1):
        following = found.next_experiment if found is not None else None
        if following is None or following.planned is None:
            break
        motion = following.planned.motion
        kinds.append(motion.kind)
        asked.append({key: following.content[key] for key in ("separates", "motion", "evidence_nats")})
        more, one = record_along(case, _positions(case, motion, limits), 100 + count, directory)
        paths.append(more)
        recordings.append(one)
        right, found = diagnose_all(case, recordings, paths, directory, limits, kinds)
        verdicts.append(named(found))
        if right:
            return {"recordings": count, "asked": asked, "verdicts": verdicts}
    return {"recordings": None, "asked": asked, "verdicts": verdicts, "stopped": len(asked) < MOST}


def main(
    json_file: Annotated[Path, typer.Option("--json")] = Path("next_experiment.json"),
    first_seed: Annotated[int, typer.Option(min=0, max=SCORED_FROM - 1)] = 5000,
    seeds: Annotated[int, typer.Option(min=1, help="Of each effect.")] = 2,
    page: Annotated[Path | None, typer.Option(help="Page whose figures are written again.")] = None,
) -> None:
    """Compare both on every case; the file is written again after each."""
    console = Console()
    rows: list[dict[str, Any]] = []
    for number in range(seeds):
        for index, effect in enumerate(EFFECTS):
            seed = first_seed + number * len(EFFECTS) + index
            with tempfile.TemporaryDirectory() as folder:
                row = one_case(seed, effect, Path(folder))
            rows.append(row)
            ways = {way: row[way]["recordings"] for way in ("fixed", "next") if way in row}
            console.print(
                f"{seed} {effect} ({row['first']}): {ways or row['why_not'] or 'right at once'}", markup=False
            )
            content = {"machine": machine_facts(), "summary": summary(rows, MOST), "rows": rows}
            text = json.dumps(content, indent=1) + "\n"
            write_whole(json_file, text)
    console.print(json.dumps(summary(rows, MOST), indent=1), markup=False)
    if page is not None:
        write_figures(json.loads(json_file.read_text(encoding="utf-8")), page)


if __name__ == "__main__":
    typer.run(main)
