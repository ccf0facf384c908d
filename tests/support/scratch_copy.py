"""A copy of the tree, changed by a worked example of docs/development.md.

An example is a folder with `change.diff` and tests that run in the changed copy. They run without compiling:
the laws are the same functions, and a copy has no machine code yet.
"""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
COPIED = (
    *("kernels", "servo_ctrl", "hil_sim", "twin", "reconcile", "studies"),
    *("machines", "eds", "docs", "tests/support"),
)
LEFT_OUT = shutil.ignore_patterns("__pycache__", "*.png")


def scratch_copy(example: Path, folder: Path) -> list[str]:
    """Copy the tree into `folder` and apply the example; return the files that it changes."""
    for name in COPIED:
        shutil.copytree(ROOT / name, folder / name, ignore=LEFT_OUT)
    shutil.copy(ROOT / "pyproject.toml", folder)
    change = example / "change.diff"
    subprocess.run(["git", "apply", str(change)], cwd=folder, check=True, capture_output=True, text=True)
    return re.findall(r"^\+\+\+ b/(\S+)$", change.read_text(encoding="utf-8"), re.MULTILINE)


def run_tests(example: Path, folder: Path) -> None:
    """Run the example's tests in the changed copy; raises AssertionError with pytest's output.

    They are copied too: beside the original they would import the support files of the unchanged tree.
    """
    paths = os.pathsep.join((str(folder), str(folder / "tests" / "support")))
    tests = [shutil.copy(file, folder) for file in sorted(example.glob("check_*.py"))]
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-W", "error", *tests],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": paths, "NUMBA_DISABLE_JIT": "1", "PYTHONDONTWRITEBYTECODE": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-1000:]
