"""Execute the notebooks in Jupyter's own kernel and keep what they print: `make notebooks`.

Each runs in a directory of its own, with the publishers' recordings as `data/`. nbclient and the kernel
are in an environment beside ours (OUT/environment), which sees our packages. Only texts are kept: files
stay small, and a diff shows which figure has changed.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from tests.campaigns.environments import environment

ROOT = Path(__file__).parents[3]
NOTEBOOKS = sorted((ROOT / "docs" / "notebooks").glob("*.ipynb"))
PACKAGES = ("nbclient==0.11.0", "nbformat==5.10.4", "ipykernel==7.4.0")
EXECUTE = """
import re, sys, nbformat
from nbclient import NotebookClient
notebook = nbformat.read(sys.argv[1], as_version=4)
NotebookClient(notebook, timeout=3600, kernel_name="python3").execute()
for cell in notebook.cells:
    cell.metadata.clear()
    if cell.cell_type == "code":
        cell.outputs = [output for output in cell.outputs if output.output_type == "stream"]
    for output in cell.get("outputs", []):  # without colours of a terminal and the blanks behind a line
        output.text = re.sub(r"\\x1b\\[[0-9;]*m| +$", "", output.text, flags=re.MULTILINE)
nbformat.validate(notebook)
nbformat.write(notebook, sys.argv[2])
"""


def code_of(notebook: Path) -> str:
    """Return the code cells, one after the other."""
    cells = json.loads(notebook.read_text(encoding="utf-8"))["cells"]
    return "\n\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "code")


def printed_by(notebook: Path) -> str:
    """Return what is kept of the last execution."""
    cells = json.loads(notebook.read_text(encoding="utf-8"))["cells"]
    outputs = [output for cell in cells for output in cell.get("outputs", [])]
    return "".join("".join(output["text"]) for output in outputs)


def execute(python: Path, notebook: Path, data: Path) -> None:
    """Execute a notebook and write it back with what it printed. Raises CalledProcessError."""
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    with tempfile.TemporaryDirectory(prefix="servo-notebook-") as place:
        (Path(place) / "data").symlink_to(data)
        executed = Path(place) / notebook.name
        command = [str(python), "-c", EXECUTE, str(notebook), str(executed)]
        variables = {**os.environ, "PATH": path, "COLUMNS": "100", "NO_COLOR": "1"}
        subprocess.run(command, cwd=place, check=True, env=variables)
        notebook.write_text(executed.read_text(encoding="utf-8"), encoding="utf-8")


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", default=[one.stem for one in NOTEBOOKS])
    parser.add_argument("--data", type=Path, default=ROOT.parent / "shared" / "data")
    parser.add_argument("--out", type=Path, default=Path("out/notebooks"))
    wanted = parser.parse_args()
    python = environment(wanted.out.resolve() / "environment", PACKAGES, ours=True) / "python"
    for notebook in NOTEBOOKS:
        if notebook.stem in wanted.names:
            print(f"== {notebook.name}", flush=True)
            execute(python, notebook, wanted.data.resolve())
            print(printed_by(notebook))


if __name__ == "__main__":
    main()
