"""Fuzzes every parser, guided by coverage; docs/hostile_bus.md.

Run as `python -m tests.campaigns.hostile.fuzz --seconds 60 [--target NAME]`.
Atheris runs each target in its own process for this wall-clock time. Failing inputs are kept below --out; put
them into tests/campaigns/hostile/crashes/TARGET/ and correct the parser.
"""

import importlib.util
import json
import re
import subprocess
import sys
import warnings
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

ROOT = Path(__file__).parents[3]
SKIPPED = "SKIPPED: atheris is not installed (it has wheels for Linux on x86_64, Python 3.11 to 3.13)"
SLOWEST_S, MEMORY_MB, LONGEST = 20, 3000, 1 << 16
"""Limits of libFuzzer: time and memory of an input, and its bytes."""
EDGES = re.compile(r"#\d+\s+\w+\s+cov: (\d+)")
EXECUTED = re.compile(r"number_of_executed_units: (\d+)")


def main(
    seconds: Annotated[int, typer.Option(help="For each target.", min=1)] = 60,
    target: Annotated[list[str] | None, typer.Option(help="Only these. Repeatable.")] = None,
    out: Annotated[Path, typer.Option(help="Corpora, failing inputs, logs.")] = Path("out/fuzz"),
    json_file: Annotated[Path, typer.Option("--json", help="The summary.")] = Path("fuzz.json"),
    child: Annotated[str, typer.Option(hidden=True)] = "",
    parser: Annotated[str, typer.Option(hidden=True)] = "",
) -> None:
    """Fuzz every parser."""
    if importlib.util.find_spec("atheris") is None:
        typer.echo(SKIPPED)
        raise typer.Exit(0)
    if child:
        run(child, parser, seconds, out)
        return
    parsers = parsers_of_targets()
    names = target or list(parsers)
    found: dict[str, Any] = {}
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns) as progress:
        bar = progress.add_task("targets", total=len(names))
        for name in names:
            progress.update(bar, description=name)
            found[name] = fuzzed(name, parsers[name], seconds, out)
            progress.advance(bar)
    json_file.write_text(
        json.dumps({"seconds_each": seconds, "targets": found}, indent=2) + "\n", encoding="utf-8"
    )
    failed = [name for name, figures in found.items() if figures["failures"]]
    for name, figures in found.items():
        typer.echo(f"{name}: {figures}")
    typer.echo(f"{len(found)} targets, {len(failed)} with failures: {json_file}")
    raise typer.Exit(1 if failed else 0)


def parsers_of_targets() -> dict[str, str]:
    """Return the parser's module by target, from a child: modules must be instrumented at their import."""
    code = "from tests.campaigns.hostile import fuzz; fuzz.find_support(); "
    code += "from tests.campaigns.hostile import all_targets; "
    code += "from tests.campaigns.hostile.targets import TARGETS as all; "
    code += "print(*(f'{name}={all[name].parser}' for name in sorted(all)))"
    found = subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=True, capture_output=True, text=True)
    return dict(pair.split("=") for pair in found.stdout.split())


def fuzzed(name: str, parser: str, seconds: int, out: Path) -> dict[str, Any]:
    """Run one target in a child; return what libFuzzer reported."""
    folder = out / name
    folder.mkdir(parents=True, exist_ok=True)
    command = [sys.executable, "-m", "tests.campaigns.hostile.fuzz", "--child", name, "--parser", parser]
    command += ["--seconds", str(seconds), "--out", str(out)]
    limit_s = seconds + 600
    ended = subprocess.run(command, cwd=ROOT, check=False, capture_output=True, timeout=limit_s)
    text = ended.stderr.decode("utf-8", "replace") + ended.stdout.decode("utf-8", "replace")
    (folder / "log").write_text(text, encoding="utf-8")
    edges, executed = EDGES.findall(text) or ["0"], EXECUTED.findall(text) or ["0"]
    failures = sorted(path.name for path in folder.glob("fail-*"))
    if ended.returncode and not failures:
        failures = [f"ended with {ended.returncode}: {text[-300:]}"]
    return {
        "executions": int(executed[-1]),
        "edges_of_the_seeds": int(edges[0]),
        "edges": int(edges[-1]),
        "failures": failures,
    }


def find_support() -> None:
    """Put the tests' support modules on the import path, as pytest does."""
    sys.path.insert(0, str(ROOT / "tests" / "support"))


def others_than(package: str) -> list[str]:
    """Return our modules outside a package: atheris instruments by prefix, which breaks numba."""
    root = ROOT / package.partition(".")[0]
    files = [path.relative_to(ROOT).with_suffix("") for path in root.rglob("*.py")]
    names = [".".join(path.parts).removesuffix(".__init__") for path in files]
    return [name for name in names if name != package and not name.startswith(f"{package}.")]


def run(name: str, parser: str, seconds: int, out: Path) -> None:
    """Instrument, import and fuzz in the child; this does not return."""
    import atheris  # noqa: PLC0415  # an extra, and not needed by the parent

    warnings.simplefilter("ignore")
    find_support()
    package = parser.rpartition(".")[0]
    with atheris.instrument_imports(include=[package], exclude=others_than(package)):
        from tests.campaigns.hostile import all_targets  # noqa: PLC0415  # to be instrumented
        from tests.campaigns.hostile.targets import TARGETS, crashes_of  # noqa: PLC0415  # the same
    assert all_targets.MODULES
    target = TARGETS[name]
    corpus = out / name / "corpus"
    corpus.mkdir(parents=True, exist_ok=True)
    kept = [path.read_bytes() for path in crashes_of(name)]
    for number, seed in enumerate([*target.seeds(), *kept]):
        (corpus / f"seed{number}").write_bytes(seed)
    words = out / name / "words"
    words.write_text(
        "".join('"' + "".join(f"\\x{byte:02x}" for byte in word) + '"\n' for word in target.words),
        encoding="ascii",
    )
    arguments = [sys.argv[0], str(corpus), f"-max_total_time={seconds}", f"-max_len={LONGEST}"]
    arguments += [f"-dict={words}"] if target.words else []
    arguments += [
        f"-artifact_prefix={out / name}/fail-",
        f"-timeout={SLOWEST_S}",
        f"-rss_limit_mb={MEMORY_MB}",
    ]
    atheris.Setup([*arguments, "-print_final_stats=1"], target.run)
    atheris.Fuzz()


if __name__ == "__main__":
    typer.run(main)
