"""Pages of the site that no file holds: command lines, Python, notebooks; decisions in the navigation.

MkDocs calls these functions by their names (`hooks` in mkdocs.yml).
"""

import json
from pathlib import Path
from typing import Any

import typer.main
from mkdocs.structure.files import File, Files
from typer.cli import get_docs_for_click

from hil_sim.cli.main import app as hil_sim
from reconcile.cli.main import app as reconcile
from servo_ctrl.cli.main import app as servo_ctrl

PROGRAMS = {"servo-ctrl": servo_ctrl, "hil-sim": hil_sim, "reconcile": reconcile}
PYTHON = """# Python

What is public, from its docstrings; how it is used: [From Python](../python.md).

## reconcile

::: reconcile.api.diagnose.diagnose

::: reconcile.api.result

::: reconcile.errors.ReconcileError

## servo_ctrl

::: servo_ctrl.client.blocking.Client

::: servo_ctrl.client.client.AsyncClient

::: servo_ctrl.client.client.CommandRefusedError

::: servo_ctrl.errors.ServoCtrlError

## hil_sim

::: hil_sim.bench.bench.Bench

::: hil_sim.bench.bench.BenchError

::: hil_sim.bench.pytest_plugin
"""


def on_config(config: Any) -> Any:
    """Put notebooks behind the tutorials; decisions, and every other page, at the end of the explanations."""
    docs = Path(config["docs_dir"])
    (tutorials,) = (entry["Tutorials"] for entry in config["nav"] if "Tutorials" in entry)
    notebooks = sorted(docs.glob("notebooks/*.ipynb"))
    tutorials.append({"Measured axes": [f"notebooks/{path.stem}.md" for path in notebooks]})
    pages = {path.relative_to(docs).as_posix() for path in docs.rglob("*.md")}
    *_, explanation = config["nav"]
    named = set(_named(config["nav"]))
    decisions = sorted(page for page in pages - named if page.startswith("decisions/"))
    explanation["Explanation"] += sorted(pages - named - set(decisions))
    explanation["Explanation"].append({"Decisions": decisions})
    return config


def on_files(files: Files, config: Any) -> Files:
    """Add the reference and the notebooks."""
    for path in sorted(Path(config["docs_dir"]).glob("notebooks/*.ipynb")):
        files.append(File.generated(config, f"notebooks/{path.stem}.md", content=notebook_page(path)))
    text = "# Command lines\n\nWhat `--help` says of each command.\n\n"
    for name, app in PROGRAMS.items():
        command = typer.main.get_command(app)
        shown = get_docs_for_click(obj=command, ctx=typer.Context(command), name=name)
        text += "\n".join(f"#{line}" if line.startswith("#") else line for line in shown.splitlines()) + "\n"
    files.append(File.generated(config, "reference/command_lines.md", content=text))
    files.append(File.generated(config, "reference/python.md", content=PYTHON))
    return files


def notebook_page(path: Path) -> str:
    """Return a notebook as a page: its text, its code, and what the code has printed."""
    parts = []
    for cell in json.loads(path.read_text(encoding="utf-8"))["cells"]:
        source = "".join(cell["source"])
        parts.append(source if cell["cell_type"] == "markdown" else f"```python\n{source}\n```")
        texts = ["".join(output["text"]) for output in cell.get("outputs", [])]
        parts += [f"```text\n{text.rstrip()}\n```" for text in texts]
    name = path.name
    return "\n\n".join([*parts, f"The notebook itself: [{name}]({name}); `make notebooks` executes it.\n"])


def _named(nav: Any) -> list[str]:
    """Return the pages that a navigation names."""
    if isinstance(nav, str):
        return [nav]
    entries = nav.values() if isinstance(nav, dict) else nav
    return [page for entry in entries for page in _named(entry)]
