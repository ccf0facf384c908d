"""docs/dependencies.md: what each dependency is for and costs. `make budget` measures it."""

import json
import re
import subprocess
import sys
import tomllib
from collections.abc import Mapping
from importlib.metadata import distribution
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[3]
FIGURES = ROOT / "docs" / "dependencies.json"
REASONS = ROOT / "docs" / "dependencies.toml"
HEAD = """# Dependencies

Made by `make pages` from `docs/dependencies.toml` and the figures of `make budget`; do not edit. MB: files of
the package alone, without what it brings. Import: processor time of a fresh interpreter, the least of three,
with all that the import brings; modules: how many it loads. No program loads all of them:
`tests/unit/command_lines/test_light_to_start.py` holds what `--help` may load.

A new one needs a reason here, a pin in `pyproject.toml` and `constraints.txt`, and one file a side that
imports it. What a library does here and what stays ours, measured beside scipy, statsmodels and ruptures:
[decision 0027](decisions/0027-libraries-that-were-measured.md).
"""
MEASURE = """
import sys, time
before, start = set(sys.modules), time.process_time()
import {module}
print(time.process_time() - start, len(set(sys.modules) - before))
"""


def reasons() -> dict[str, dict[str, str]]:
    """Return module, extra, why and leave by package."""
    return tomllib.loads(REASONS.read_text(encoding="utf-8"))


def declared() -> dict[str, str]:
    """Return the extra ("" = always) of each dependency that pyproject.toml gives to users."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    lists = {"": project["dependencies"]} | {
        extra: listed
        for extra, listed in project["optional-dependencies"].items()
        if extra not in {"dev", "mutation"}
    }
    return {re.split(r"[=<>\[; ]", text)[0]: extra for extra, listed in lists.items() for text in listed}


def page(figures: Mapping[str, Any]) -> str:
    """Return the page as Markdown."""
    lines = [HEAD]
    for extra in dict.fromkeys(one["extra"] for one in reasons().values()):
        lines += [
            f"## {f'With `[{extra}]`' if extra else 'Always'}",
            "",
            "| package | why | MB | import, s | modules | what it would take to leave |",
            "|---|---|---|---|---|---|",
        ]
        for name, one in reasons().items():
            if one["extra"] == extra:
                cost = figures[name]
                lines.append(
                    f"| {name} {cost['version']} | {one['why']} | {cost['mb']:.1f} | {cost['import_s']:.2f} "
                    f"| {cost['modules']} | {one['leave']} |"
                )
        lines.append("")
    return "\n".join(lines)


def measured(name: str, module: str) -> dict[str, Any]:
    """Return version, megabytes, and processor time and modules of an import."""
    found = distribution(name)
    sizes = [Path(str(file.locate())) for file in found.files or ()]
    runs = [
        subprocess.run(
            [sys.executable, "-c", MEASURE.format(module=module)], capture_output=True, text=True, check=True
        ).stdout.split()
        for _ in range(3)
    ]
    return {
        "version": found.version,
        "mb": round(sum(path.stat().st_size for path in sizes if path.is_file()) / 1e6, 2),
        "import_s": round(min(float(run[0]) for run in runs), 3),
        "modules": int(runs[0][1]),
    }


if __name__ == "__main__":
    FIGURES.write_text(
        json.dumps({name: measured(name, one["module"]) for name, one in reasons().items()}, indent=1) + "\n",
        encoding="utf-8",
    )
