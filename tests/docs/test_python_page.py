"""The examples of docs/python.md are executed as they stand, each in a program and a directory of its own."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

PAGE = (Path(__file__).parents[2] / "docs" / "python.md").read_text(encoding="utf-8")
EXAMPLES = re.findall(r"```python\n(.*?)```", PAGE, flags=re.DOTALL)
LIMIT_S = 600.0
"""A hang, not a pace: kernels may be compiled anew on a busy machine."""


@pytest.mark.parametrize("number", range(len(EXAMPLES)))
def test_an_example_runs_as_it_stands(number: int, tmp_path: Path) -> None:
    command = [sys.executable, "-c", EXAMPLES[number]]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False, timeout=LIMIT_S)
    assert done.returncode == 0, done.stderr


def test_the_plugin_serves_a_machine_to_a_test_and_skips_where_none_is_named(tmp_path: Path) -> None:
    (tmp_path / "test_mine.py").write_text(
        "def test_mine(hil_bench):\n    assert hil_bench.bus.startswith('localcan:')\n", encoding="utf-8"
    )
    plugin = [sys.executable, "-m", "pytest", "-q", "-p", "hil_sim.bench.pytest_plugin", "--rootdir=."]
    for words, outcome in ((["--hil", "xy_table"], "1 passed"), ([], "1 skipped")):
        command = [*plugin, *words, "test_mine.py"]
        done = subprocess.run(
            command, cwd=tmp_path, capture_output=True, text=True, check=False, timeout=LIMIT_S
        )
        assert outcome in done.stdout, done.stdout + done.stderr
