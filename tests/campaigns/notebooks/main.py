"""Execute the code cells of notebooks in plain Python, each in a process and a directory of its own."""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[3]
NOTEBOOKS = sorted((ROOT / "docs" / "notebooks").glob("*.ipynb"))


def code_of(notebook: Path) -> str:
    """Return the code cells, one after the other."""
    cells = json.loads(notebook.read_text(encoding="utf-8"))["cells"]
    return "\n\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "code")


def run(notebook: Path) -> None:
    """Execute a notebook. Raises CalledProcessError."""
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    with tempfile.TemporaryDirectory(prefix="servo-notebook-") as place:
        command = [sys.executable, "-c", code_of(notebook)]
        subprocess.run(command, cwd=place, check=True, env={**os.environ, "PATH": path})


if __name__ == "__main__":
    for one in NOTEBOOKS:
        print(f"== {one.name}", flush=True)
        run(one)
