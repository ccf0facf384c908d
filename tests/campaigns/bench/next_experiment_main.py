"""How many recordings the next experiment saves against a fixed test programme, on ambiguous concealed cases.

Run as `python -m tests.campaigns.bench.next_experiment_main --json FILE [--first-seed 5000] [--seeds 2]
[--page FILE]`. Each case is a drawn axis (`tests.campaigns.blind`) with one concealed effect, recorded once
in production, for 3 s: a circle on even seeds, moves on odd ones. Effects are those that the catalogue's
column "confused with" speaks of. From that one recording on, both go on until the verdict is right: the next
experiment asks for a motion each time, the fixed programme makes its motions in their order. Both move within
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
from reconcile.diagnosis.diagnose import Diagnosis, diagnose
from reconcile.errors import ReconcileError
from reconcile.trials.score import score
from tests.campaigns.bench.main import machine_facts, write_whole
from tests.campaigns.bench.next_experiment_page import write_figures
from tests.campaigns.blind.asked import record_asked
from tests.campaigns.blind.case import Case, Made
from tests.campaigns.blind.draws import WARMED, draw
from tests.campaigns.blind.effects import CATALOGUE
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
"""Further recordings."""
FIRST_S = 3.0
"""Of the first recording: a stroke or two, a round or two."""
TRAVEL = 0.45
"""Of it, to either side of the middle."""
RESAMPLES = 4000


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


def is_right(case: Case, made: Sequence[Made], verdict: dict[str, Any]) -> bool:
    """The effect is named, uncontested, and nothing else is."""
    sealed = json.loads(json.dumps(truth(case, [made[0]])))
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


def told(
    case: Case,
    made: Sequence[Made],
    paths: Sequence[Path],
    directory: Path,
    limits: AxisLimits | None = None,
    kinds: Sequence[str] = (),
) -> tuple[bool, Diagnosis | None]:
    """Whether the verdict is right; None where there is none. Without limits nothing is asked for."""
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
    return is_right(case, made, found.verdict), found


def one_case(seed: int, effect: str, directory: Path) -> dict[str, Any]:
    """Both ways from one first recording."""
    case, started_s = case_of(seed, effect), time.perf_counter()
    paths, made = record(case, directory), [simulated(case, case.runs[0])]
    limits = limits_from_machine(case)
    row: dict[str, Any] = {
        "seed": seed,
        "effect": effect,
        "first": case.runs[0].motion,
        "has_scale": case.sensing.has_scale,
    }
    right, found = told(case, made, paths, directory, limits)
    row["first_verdict"] = [f["effect"] for f in found.verdict["findings"]] if found else None
    programme = fixed_programme(case, limits)
    recorded = [
        record_asked(case, _positions(case, motion, limits), number, directory)
        for number, motion in enumerate(programme, start=1)
    ]
    slow = case.runs[0]._replace(motion="slow")  # of the programme, which has slow constant speeds
    judging = case._replace(runs=(*case.runs, slow))
    seen = judged(judging, [*made, *(one for _, one in recorded)])[effect]
    row["observable"], row["why_not"] = seen["observable"], seen["why_not"]
    row["ambiguous"] = not right
    if right or not seen["observable"] or found is None:
        return row
    row["fixed"] = _by_programme(case, made[0], paths[0], recorded, directory)
    row["next"] = _by_asking(case, made[0], paths[0], found, directory, limits)
    row["seconds"] = round(time.perf_counter() - started_s, 1)
    return row


def _positions(case: Case, motion: Excitation, limits: AxisLimits) -> np.ndarray[Any, np.dtype[np.float64]]:
    planned = plan_motion(motion, limits, case.control_s)
    assert planned is not None, motion.words
    return planned.position_m


def _by_programme(
    case: Case, first: Made, path: Path, recorded: Sequence[tuple[Path, Made]], directory: Path
) -> dict[str, Any]:
    """Recording after recording, as it was planned."""
    said = []
    for count in range(1, len(recorded) + 1):
        paths = [path, *(one for one, _ in recorded[:count])]
        made = [first, *(one for _, one in recorded[:count])]
        right, found = told(case, made, paths, directory)
        said.append([f["effect"] for f in found.verdict["findings"]] if found else None)
        if right:
            return {"recordings": count, "verdicts": said}
    return {"recordings": None, "verdicts": said}


def _by_asking(
    case: Case, first: Made, path: Path, found: Diagnosis | None, directory: Path, limits: AxisLimits
) -> dict[str, Any]:
    """Recording after recording, each asked for by the verdict on those before."""
    paths, made, kinds, said = [path], [first], [], []
    asked = []
    for count in range(1, MOST + 1):
        following = found.next_experiment if found is not None else None
        if following is None or following.planned is None:
            break
        motion = following.planned.motion
        kinds.append(motion.kind)
        asked.append({key: following.content[key] for key in ("separates", "motion", "evidence_nats")})
        more, one = record_asked(case, _positions(case, motion, limits), 100 + count, directory)
        paths.append(more)
        made.append(one)
        right, found = told(case, made, paths, directory, limits, kinds)
        said.append([f["effect"] for f in found.verdict["findings"]] if found else None)
        if right:
            return {"recordings": count, "asked": asked, "verdicts": said}
    return {"recordings": None, "asked": asked, "verdicts": said, "stopped": len(asked) < MOST}


def summary(rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Means over cases, one that is never right counted as one recording more than there may be."""
    counted = [row for row in rows if "next" in row]
    if not counted:
        return {"cases": 0}
    counts = {way: np.array([_count(row[way]) for row in counted]) for way in ("fixed", "next")}
    rng = np.random.default_rng(0)
    draws = rng.integers(len(counted), size=(RESAMPLES, len(counted)))
    saved = counts["fixed"] - counts["next"]
    found: dict[str, Any] = {
        "cases": len(counted),
        "drawn": len(rows),
        "right_at_once": sum(not row["ambiguous"] for row in rows),
        "not_observable": sum(row["ambiguous"] and not row["observable"] for row in rows),
        "saved": _with_interval(saved, draws),
    }
    for way, own in counts.items():
        found[way] = {
            "recordings": _with_interval(own, draws),
            "right_within": [float(np.mean(own <= count)) for count in range(1, MOST + 1)],
            "never": _with_interval((own > MOST).astype(float), draws),
        }
    return found


def _count(way: dict[str, Any]) -> float:
    return float(way["recordings"] or MOST + 1)


def _with_interval(values: np.ndarray[Any, Any], draws: np.ndarray[Any, Any]) -> dict[str, Any]:
    low, high = np.percentile(values[draws].mean(axis=1), [2.5, 97.5])
    return {"mean": float(values.mean()), "ci95": [float(low), float(high)]}


def main(
    json_file: Annotated[Path, typer.Model("--json")] = Path("next_experiment.json"),
    first_seed: Annotated[int, typer.Model(min=0, max=SCORED_FROM - 1)] = 5000,
    seeds: Annotated[int, typer.Model(min=1, help="Of each effect.")] = 2,
    page: Annotated[Path | None, typer.Model(help="Page whose figures and picture are made anew.")] = None,
) -> None:
    """Both ways on every case; written anew after each."""
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
            content = {"machine": machine_facts(), "summary": summary(rows), "rows": rows}
            text = json.dumps(content, indent=1) + "\n"
            write_whole(json_file, text)
    console.print(json.dumps(summary(rows), indent=1), markup=False)
    if page is not None:
        write_figures(json.loads(json_file.read_text(encoding="utf-8")), page)


if __name__ == "__main__":
    typer.run(main)
