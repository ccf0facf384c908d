"""The disk caches of the kernels: named by content, the present one stays, old ones do not pile up."""

import os
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from kernels.jit import PACKAGES, forget_old_caches, reachable_files

ROOT = Path(__file__).parents[3]
PREFIX = "somewhere-kernels-"


def folder(parent: Path, name: str, age_s: int) -> Path:
    made = parent / name
    made.mkdir()
    (made / "kernel.nbc").write_bytes(b"code")
    os.utime(made, (1_000_000 - age_s, 1_000_000 - age_s))
    return made


def test_the_present_and_the_last_used_stay(tmp_path: Path) -> None:
    present = folder(tmp_path, f"{PREFIX}now", 500)
    for age_s in (100, 200, 300, 400):
        folder(tmp_path, f"{PREFIX}{age_s}", age_s)
    folder(tmp_path, "kernels-of-someone-else", 900)
    forget_old_caches(present, PREFIX, kept=2)
    left = {item.name for item in tmp_path.iterdir()}
    assert left == {"kernels-of-someone-else", f"{PREFIX}100", f"{PREFIX}200", f"{PREFIX}now"}
    assert present.stat().st_mtime > 1_000_000


def test_every_package_that_may_hold_kernels_is_part_of_the_content() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    shipped = set(project["tool"]["hatch"]["build"]["targets"]["wheel"]["only-include"])
    without_kernels = {"local_can", "shipped_files", "eds", "machines"}
    assert shipped - set(PACKAGES) == without_kernels


def test_what_a_room_imports_is_part_of_its_content() -> None:
    def rooms(name: str) -> set[str]:
        files = reachable_files(ROOT, ROOT / name)
        return {"/".join(file.relative_to(ROOT).parts[:-1][:2]) for file in files}

    assert rooms("servo_ctrl/control") == {"servo_ctrl/control", "servo_ctrl", "kernels"}
    assert rooms("hil_sim/plant") == {"hil_sim/plant", "hil_sim/physics", "kernels"}


def test_caches_are_not_looked_into_while_another_process_deletes_them(tmp_path: Path) -> None:
    room = tmp_path / "package" / "room"
    (room / "inner").mkdir(parents=True)
    for file in (room / "a.py", room / "inner" / "b.py"):
        file.write_text("")
    old = folder(room, "__pycache__", 0)
    (old / "room-kernels-old.py").write_text("")
    assert reachable_files(tmp_path, room) == [room / "a.py", room / "inner" / "b.py"]


MODULES = {
    "kernels/__init__.py": "",
    "kernels/jit.py": (ROOT / "kernels" / "jit.py").read_text(encoding="utf-8"),
    "kernels/lean_import.py": (ROOT / "kernels" / "lean_import.py").read_text(encoding="utf-8"),
    "servo_ctrl/__init__.py": "",
    "servo_ctrl/upper/__init__.py": "",
    "servo_ctrl/upper/caller.py": (
        "from kernels.jit import kernel\n"
        "from servo_ctrl.lower.callee import callee\n"
        "@kernel\n"
        "def caller(x):\n"
        "    return callee(x) + 1.0\n"
    ),
    "servo_ctrl/lower/__init__.py": "",
    "servo_ctrl/lower/callee.py": (
        "from kernels.jit import kernel\n@kernel\ndef callee(x):\n    return 2.0 * x\n"
    ),
}
PROGRAM = (
    "from servo_ctrl.upper.caller import caller; print(caller(3.0), sum(caller.stats.cache_hits.values()))"
)


def output(root: Path, **environment: str) -> str:
    """What the caller gives in a process of its own, and how often its machine code came from the disk."""
    clean = {name: value for name, value in os.environ.items() if name != "NUMBA_CACHE_DIR"}
    variables = clean | {"PYTHONPATH": str(root), "PYTHONDONTWRITEBYTECODE": "1"} | environment
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM], cwd="/", env=variables, capture_output=True, text=True, check=True
    )
    return done.stdout.strip()


@pytest.fixture
def house(tmp_path: Path) -> Path:
    root = tmp_path / "house"
    for name, text in MODULES.items():
        file = root / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")
    return root


def test_a_change_in_a_room_that_is_called_reaches_the_caller(house: Path) -> None:
    assert [output(house), output(house)] == ["7.0 0", "7.0 1"]
    callee = house / "servo_ctrl" / "lower" / "callee.py"
    callee.write_text(callee.read_text(encoding="utf-8").replace("2.0 * x", "3.0 * x"), encoding="utf-8")
    assert output(house) == "10.0 0"


def test_read_only_files_are_cached_elsewhere(house: Path, tmp_path: Path) -> None:
    for package in (house / "servo_ctrl" / "upper", house / "servo_ctrl" / "lower"):
        (package / "__pycache__").write_text("no folder can be made here by any user", encoding="utf-8")
    own = {"XDG_CACHE_HOME": str(tmp_path / "own")}
    assert [output(house, **own), output(house, **own)] == ["7.0 0", "7.0 1"]
    assert len(list((tmp_path / "own" / "servo-kernels").glob("servo_ctrl.upper-kernels-*"))) == 1


def test_without_a_writable_place_kernels_are_compiled_again(house: Path, tmp_path: Path) -> None:
    nowhere = tmp_path / "file"
    nowhere.write_text("", encoding="utf-8")
    assert [output(house, NUMBA_CACHE_DIR=str(nowhere))] * 2 == ["7.0 0", "7.0 0"]
