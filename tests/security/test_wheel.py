"""The wheel is whole: installed into an environment of its own it works anywhere, without the checkout."""

import json
import os
import shutil
import subprocess
import sys
import sysconfig
import tarfile
import venv
import zipfile
from pathlib import Path

import pytest
from numba.core.caching import _CacheLocator

from kernels.jit import PACKAGES

ROOT = Path(__file__).parents[2]
ODRIVE = ROOT.parent / "shared" / "data" / "odrive_cogging"
SHIPPED = {"eds/servo_drive.eds", "machines/xy_table/plant.toml", "machines/xy_table/programs/circles.toml"}


def build(source: Path, kind: str, out: Path) -> Path:
    command = [sys.executable, "-m", "hatchling", "build", "-t", kind, "-d", str(out)]
    subprocess.run(command, cwd=source, check=True, capture_output=True)
    return next(out.glob("*.whl" if kind == "wheel" else "*.tar.gz"))


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build(ROOT, "wheel", tmp_path_factory.mktemp("wheel"))


@pytest.fixture(scope="module")
def programs(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """`bin` of an environment with the wheel; its dependencies are those of the environment of the tests."""
    place = tmp_path_factory.mktemp("installed")
    venv.create(place, with_pip=False, symlinks=True)
    packages = Path(sysconfig.get_path("purelib", vars={"base": str(place)}))
    (packages / "dependencies.pth").write_text(sysconfig.get_path("purelib") + "\n", encoding="utf-8")
    install = ["-m", "pip", "--python", str(place / "bin" / "python"), "install", "--no-deps", "--no-index"]
    command = [sys.executable, *install, "--ignore-installed", "--no-compile", "--quiet", str(wheel)]
    subprocess.run(command, check=True, capture_output=True)
    share_kernels(packages)
    return place / "bin"


def share_kernels(packages: Path) -> None:
    """Give the installed packages the machine code of the checkout, which has the same contents.

    `make demo` compiles all of it. Numba knows a file by the path of its folder, its size and its time.
    """

    def name_of(folder: Path) -> str:
        return str(_CacheLocator.get_suitable_cache_subpath(str(folder / "any.py")))

    sources = [file for package in PACKAGES for file in (ROOT / package).rglob("*.py")]
    for file in sources:
        time_ns = file.stat().st_mtime_ns
        os.utime(packages / file.relative_to(ROOT), ns=(time_ns, time_ns))
    names = {name_of(file.parent): name_of(packages / file.parent.relative_to(ROOT)) for file in sources}
    for package in PACKAGES:
        for kept in (ROOT / package).rglob("__pycache__/*-kernels-*/*"):
            if kept.name in names:  # else of a checkout that was elsewhere
                shutil.copytree(kept, packages / kept.parent.relative_to(ROOT) / names[kept.name])


def run(programs: Path, directory: Path, *words: str, exit_code: int = 0) -> str:
    environment = {
        "PATH": os.environ["PATH"],
        "HOME": str(directory),
        "XDG_STATE_HOME": str(directory / "state"),
    }
    command = [str(programs / words[0]), *words[1:]]
    done = subprocess.run(
        command, cwd=directory, env=environment, capture_output=True, text=True, check=False, timeout=800
    )
    assert done.returncode == exit_code, done.stdout + done.stderr
    return done.stdout + done.stderr


def test_machines_and_eds_files_are_in_the_wheel_and_nothing_that_was_learned(wheel: Path) -> None:
    names = set(zipfile.ZipFile(wheel).namelist())
    assert {f"shipped_files/{name}" for name in SHIPPED} <= names
    assert not [name for name in names if "/learned/v" in name or name.startswith("tests/")]


def test_the_licence_is_in_the_wheel_and_named_in_its_metadata(wheel: Path) -> None:
    packed = zipfile.ZipFile(wheel)
    (metadata,) = (name for name in packed.namelist() if name.endswith(".dist-info/METADATA"))
    folder = metadata.removesuffix("METADATA")
    assert packed.read(f"{folder}licenses/LICENSE") == (ROOT / "LICENSE").read_bytes()
    lines = packed.read(metadata).decode().splitlines()
    assert {"License-Expression: Apache-2.0", "License-File: LICENSE"} <= set(lines)


def test_the_source_distribution_builds_the_same_wheel(wheel: Path, tmp_path: Path) -> None:
    with tarfile.open(build(ROOT, "sdist", tmp_path)) as archive:
        archive.extractall(tmp_path, filter="data")
    (source,) = (entry for entry in tmp_path.iterdir() if entry.is_dir())
    assert (source / "LICENSE").is_file()
    assert build(source, "wheel", tmp_path / "again").read_bytes() == wheel.read_bytes()


def test_an_installed_controller_checks_a_shipped_machine_from_any_directory(
    programs: Path, tmp_path: Path
) -> None:
    program = "machines/xy_table/programs/circles.toml"
    run(programs, tmp_path, "servo-ctrl", "check", "--machine", "xy_table", "--program", program)


def test_an_installed_controller_copies_a_machine_that_is_whole_by_itself(
    programs: Path, tmp_path: Path
) -> None:
    run(programs, tmp_path, "servo-ctrl", "new-machine", "mine", "--from", "precision_stage")
    run(programs, tmp_path, "servo-ctrl", "check", "--machine", "mine")
    assert "../" not in (tmp_path / "mine" / "plant.toml").read_text(encoding="utf-8")


def test_the_installed_demo_moves_the_installed_table_from_any_directory(
    programs: Path, tmp_path: Path
) -> None:
    """It starts the installed `hil-sim run` beside it."""
    before = set(installed_files(programs))
    run(programs, tmp_path, "servo-ctrl", "demo", "--no-hmi")
    demo = tmp_path / "out" / "demo"
    assert all((demo / name).stat().st_size > 10_000 for name in ("reversals.png", "contour.png"))
    assert json.loads((demo / "recording" / "recording.json").read_text(encoding="utf-8"))["format"] == 1
    assert set(installed_files(programs)) == before


def installed_files(programs: Path) -> list[Path]:
    """All files of the environment without what Python and numba have compiled."""
    files = (file for file in programs.parent.rglob("*") if file.is_file())
    return [file for file in files if "__pycache__" not in file.parts]


def test_an_installed_example_says_who_publishes_its_data(programs: Path, tmp_path: Path) -> None:
    said = run(programs, tmp_path, "reconcile", "example", "emps", "--out", "out/emps", exit_code=1)
    assert "https://www.nonlinearbenchmark.org" in said


@pytest.mark.skipif(not ODRIVE.is_dir(), reason="the publishers' recordings are not here")
def test_an_installed_example_diagnoses_a_measured_axis(programs: Path, tmp_path: Path) -> None:
    run(programs, tmp_path, "reconcile", "example", "odrive", "--data", str(ODRIVE), "--out", "out")
    assert (tmp_path / "out" / "diagnosis" / "verdict.json").is_file()


ALL_OF_IT = """
import json, sys, shipped_files, servo_ctrl
from pathlib import Path
from hil_sim.config import load_plant
from shipped_files import shipped
from reconcile.nominal_model.model_file import load_model, write_model
from servo_ctrl.config.load import load_machine
from servo_ctrl.learned.store import default_directory

Path("bare.toml").write_text(sys.argv[1])
write_model(load_model(Path("bare.toml")), {}, Path("model.toml"))
print(json.dumps({
    "package": servo_ctrl.__file__,
    "shipped": str(shipped(Path("xy_table"))),
    "written": len(load_plant(Path("model.toml")).axes),
    "learned": str(default_directory(load_machine(shipped(Path("xy_table"))))),
}))
"""
BARE = "[axis.x]\ntransmission.lead_mm = 10\nmotor.torque_constant_nm_a = 0.5\ntable.mass_kg = 50\n"


def test_an_installed_package_finds_its_files_and_never_writes_beside_them(
    programs: Path, tmp_path: Path
) -> None:
    facts = json.loads(run(programs, tmp_path, "python", "-c", ALL_OF_IT, BARE))
    inside = programs.parent
    assert Path(facts["package"]).is_relative_to(inside)
    assert Path(facts["shipped"]).is_relative_to(inside)
    assert facts["written"] == 1  # its EDS file was found
    assert Path(facts["learned"]) == tmp_path / "state" / "servo_ctrl" / "xy_table" / "learned"
