"""A command imports only what it uses: `--help` and an unknown subcommand load neither numerics nor bus."""

import subprocess
import sys
from importlib.metadata import entry_points

import pytest

PROGRAMS = {
    "servo-ctrl": "servo_ctrl.cli.main",
    "hil-sim": "hil_sim.cli.main",
    "reconcile": "reconcile.cli.main",
}
SUBCOMMANDS = [
    *(("servo-ctrl", name) for name in ("run", "learn", "check", "export", "report", "demo", "ask")),
    *(("servo-ctrl", f"learned {name}") for name in ("list", "show", "rollback", "plot")),
    *(
        ("servo-ctrl", f"experiment {name}")
        for name in sorted(entry_points(group="servo_ctrl.studies").names)
    ),
    ("servo-ctrl", "experiment"),
    ("servo-ctrl", "new-machine"),
    ("hil-sim", "run"),
    *(("reconcile", name) for name in ("diagnose", "example", "fleet", "loop", "trial", "watch")),
]
HEAVY = {
    *("numba", "numpy", "scipy", "pandas", "pyarrow", "asammdf", "dask", "distributed", "fsspec"),
    *("matplotlib", "plotly", "nicegui", "canopen", "can", "aiomqtt", "asyncio"),
}
"""Libraries that only the work needs."""
OURS = {
    "servo_ctrl",
    "hil_sim",
    "reconcile",
    "studies",
    "twin",
    "kernels",
    "local_can",
    "can_frames",
    "shipped_files",
}
HELP_OF_A_PROGRAM = 360
"""Modules that `--help` of a program may load: 335 on Python 3.11, of which typer and rich bring 320."""
OWN_MODULES = 21
"""Modules of ours among them: the declarations of all subcommands, their options, the errors; 16 today."""


def modules_of(program: str, words: str) -> set[str]:
    """Names of the modules that are loaded when the program has ended."""
    code = (
        "import atexit, sys; atexit.register(lambda: print(*sys.modules, file=sys.stderr)); "
        f"sys.argv = ['{program}', *{words.split()!r}]; "
        f"from {PROGRAMS[program]} import main; main()"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    return set(done.stderr.splitlines()[-1].split())


def packages_of(modules: set[str]) -> set[str]:
    return {name.partition(".")[0] for name in modules}


@pytest.mark.parametrize("program", PROGRAMS)
def test_help_of_a_program_loads_no_heavy_library(program: str) -> None:
    modules = modules_of(program, "--help")
    assert not packages_of(modules) & (HEAVY | {"pydantic"})
    assert len(modules) < HELP_OF_A_PROGRAM
    assert sum(name.partition(".")[0] in OURS for name in modules) <= OWN_MODULES


@pytest.mark.parametrize(("program", "name"), SUBCOMMANDS)
def test_help_of_a_subcommand_loads_no_heavy_library(program: str, name: str) -> None:
    modules = modules_of(program, f"{name} --help")
    assert not packages_of(modules) & HEAVY


@pytest.mark.parametrize("words", ["run --no-such-option", "experiment no-such-study", "no-such-command"])
def test_an_unknown_subcommand_loads_no_heavy_library(words: str) -> None:
    assert not packages_of(modules_of("servo-ctrl", words)) & HEAVY
