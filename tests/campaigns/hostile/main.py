"""Sends hostile frames to hub, simulator and controller; docs/hostile_bus.md.

Run as `python -m tests.campaigns.hostile.main --frames 1000000 --json hostile.json`.
Most frames go to these programs as processes, at full rate; the others to the same programs in simulated
time, where every position is checked. The same seed sends the same frames.
"""

import json
import os
import tempfile
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from tests.campaigns.campaign.machine import make_machine
from tests.campaigns.hostile.attack import legitimate_traffic, run_attack
from tests.campaigns.hostile.plan import plan_attacks
from tests.campaigns.hostile.processes import Rig
from tests.campaigns.hostile.scenarios import (
    OnSent,
    Result,
    everything,
    malformed_packets,
    moving,
    standing_by,
)
from tests.campaigns.hostile.verdict import judge

FRAMES_PER_ATTACK = 1000
SHARES = {"standing by": 0.3, "everything": 0.3, "moving": 0.1}
"""Shares of the frames by scenario; the others are sent in simulated time."""
EPISODES = 8
"""Controllers that are attacked in motion."""
PACKETS = 2000
"""Connections that send malformed packets to the hub."""


def main(
    frames: Annotated[int, typer.Option(help="Hostile frames in all.", min=10_000)] = 1_000_000,
    json_file: Annotated[Path, typer.Option("--json", help="The summary.")] = Path("hostile.json"),
    seed: Annotated[int, typer.Option(help="The same seed sends the same frames.")] = 8,
) -> None:
    """Send hostile frames to everything that is on the bus."""
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    begun_s = time.monotonic()
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns) as progress, tempfile.TemporaryDirectory(prefix="hostile-") as place:
        bar = progress.add_task("hostile frames", total=frames)

        def on_sent(count: int) -> None:
            progress.advance(bar, count)

        def report(text: str) -> None:
            progress.console.print(text, markup=False)

        results = [simulated(frames, seed, Path(place), on_sent, report)]
        for result in at_full_rate(frames, seed, Path(place), on_sent):
            results.append(result)
            for text in result.problems:
                report(f"{result.name}: {text}")
    problems = [f"{result.name}: {text}" for result in results for text in result.problems]
    facts: dict[str, Any] = {
        "frames": sum(result.sent.frames for result in results),
        "seconds": round(time.monotonic() - begun_s, 1),
        "seed": seed,
        "problems": problems,
        "scenarios": {
            f"{place}. {result.name}": {
                **result.sent._asdict(),
                **result.figures,
                "problems": result.problems,
            }
            for place, result in enumerate(results, 1)
        },
    }
    json_file.write_text(json.dumps(facts, indent=2) + "\n", encoding="utf-8")
    typer.echo(f"{facts['frames']} frames in {facts['seconds']:.0f} s, {len(problems)} problems: {json_file}")
    raise typer.Exit(1 if problems else 0)


def simulated(
    frames: int, seed: int, place: Path, on_sent: OnSent, report: Callable[[str], object]
) -> Result:
    """Run the attacks in simulated time, each on its own run; pass problems to `report` as they occur."""
    from tests.campaigns.hostile.flood import Sent  # noqa: PLC0415

    folder = place / "machine"
    folder.mkdir()
    machine, begun_s = make_machine(folder), time.monotonic()
    attacks = plan_attacks(
        seed, round(frames * (1.0 - sum(SHARES.values())) / FRAMES_PER_ATTACK), FRAMES_PER_ATTACK
    )
    problems: list[str] = []
    moved: dict[str, float] = {}
    reactions: list[int] = []
    unpowered = answers = sent = 0
    for number, attack in enumerate(attacks):
        run = place / f"run{number}"
        run.mkdir()
        outcome = run_attack(attack, machine, run)
        verdict = judge(outcome)
        for text in verdict.problems:
            problems.append(f"{attack}: {text}")
            report(problems[-1])
        kind = f"{attack.family}, {'harmless only' if attack.only_harmless else 'all'}"
        moved[kind] = max(moved.get(kind, 0.0), verdict.moved_mm)
        reactions += [verdict.reaction_cycles] if verdict.reaction_cycles is not None else []
        unpowered, answers, sent = (
            unpowered + verdict.unpowered,
            answers + outcome.answers,
            sent + outcome.sent,
        )
        on_sent(outcome.sent)
    figures = {
        "runs": len(attacks),
        "runs_without_power": unpowered,
        "largest_motion_mm": {kind: round(moved[kind], 4) for kind in sorted(moved)},
        "reactions_to_another_controller": len(reactions),
        "slowest_reaction_cycles": max(reactions, default=0),
    }
    return Result("simulated time", Sent(sent, answers, time.monotonic() - begun_s), tuple(problems), figures)


def at_full_rate(frames: int, seed: int, place: Path, on_sent: OnSent) -> Iterator[Result]:
    """Run the scenarios with processes on the localcan bus; each run has new processes."""
    folder = place / "table"
    folder.mkdir()
    make_machine(folder)
    traffic = legitimate_traffic()

    def with_new_processes(scenario: Callable[[Rig], Result]) -> Result:
        with tempfile.TemporaryDirectory(prefix="hostile-") as own, Rig(Path(own), folder) as rig:
            result = scenario(rig)
            problems = [] if rig.simulator.alive else ["the simulator has ended"]
        for name, process in (("simulator", rig.simulator), ("hub", rig.hub)):
            problems += [f"{name}: {process.traceback}"] if process is not None and process.traceback else []
        return result._replace(problems=(*result.problems, *problems))

    shares = {name: round(frames * share) for name, share in SHARES.items()}
    flooded = partial(partial, traffic=traffic, on_sent=on_sent)
    yield with_new_processes(flooded(standing_by, count=shares["standing by"], seed=seed))
    yield with_new_processes(flooded(everything, count=shares["everything"], seed=seed + 1))
    for episode in range(EPISODES):
        yield with_new_processes(flooded(moving, count=shares["moving"] // EPISODES, seed=seed + 2 + episode))
    yield with_new_processes(
        lambda rig: malformed_packets(rig, PACKETS, seed, Path(rig.bus.partition(":")[2]))
    )


if __name__ == "__main__":
    typer.run(main)
