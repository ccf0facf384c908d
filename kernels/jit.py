"""The one decorator of compiled functions: pure functions, the same for one call and for a batch.

Numba's disk cache looks at the file of the cached function alone: after a change in a file that it calls,
the old machine code would go on running. Therefore the folder of the cache is named after the content of
every file that a kernel can reach: those of its own room, and of the rooms that these import, and so on.
A room is a folder two levels down (`servo_ctrl/control`), or the loose files of a package (`kernels`).
Of the folders of earlier contents the last used few stay.
"""

import contextlib
import hashlib
import os
import re
import shutil
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any, TypeVar, cast

from kernels.lean_import import as_if_absent

with as_if_absent("scipy"):  # for linear algebra within kernels, of which there is none: 17 MB and 0.4 s
    import numba
    import numba.np.arraymath

F = TypeVar("F", bound="Callable[..., Any]")

HOUSE = ("kernels", "servo_ctrl", "hil_sim", "twin", "reconcile", "studies")
"""Packages whose files are part of the content; a library's version is numba's own concern."""
KEPT = 3
"""Folders of earlier contents that stay: of another branch, or of a process that still runs."""
_SETTINGS: Any = numba.config
_IMPORTED = re.compile(rf"^(?:from|import) ((?:{'|'.join(HOUSE)})\b[\w.]*)", re.MULTILINE)


def kernel(function: F) -> F:
    """Compile `function`, cached on disk, with numpy's arithmetic (x / 0 is inf).

    To the type checker the kernel stays the function it was. There is no fast-math: the daemon, the
    simulator and the batch twin must give the same bits.
    """
    return _compiled(function, nogil=False)


def threaded_kernel(function: F) -> F:
    """Compile likewise, for long calls: other Python threads run meanwhile."""
    return _compiled(function, nogil=True)


def uncached_kernel(function: F) -> F:
    """Compile a closure over other kernels, for this process alone."""
    return cast("F", numba.njit(error_model="numpy")(function))


def signatures(function: Callable[..., Any]) -> int:
    """Number of combinations of argument types that a kernel is compiled for; more than one is a slip."""
    return len(cast("Any", function).signatures)


def _compiled(function: F, *, nogil: bool) -> F:
    folder = _cache_folder(*_room_of(function))
    before = _SETTINGS.CACHE_DIR
    _SETTINGS.CACHE_DIR = str(folder or "")
    try:
        compiler = numba.njit(cache=folder is not None, error_model="numpy", nogil=nogil)
        return cast("F", compiler(function))
    finally:
        _SETTINGS.CACHE_DIR = before


def _room_of(function: Callable[..., Any]) -> tuple[Path, Path]:
    """The folder that holds our packages, and the room of a function in it."""
    file = Path(function.__code__.co_filename)
    root = file.parents[function.__module__.count(".")]
    return root, _room(root, function.__module__)


def _room(root: Path, module: str) -> Path:
    package, *inner = module.split(".")
    folder = root / package
    return folder / inner[0] if inner and (folder / inner[0]).is_dir() else folder


def _files(root: Path, room: Path) -> list[Path]:
    """Of a room and the folders in it, but for caches: another process may be deleting folders there."""
    if room.parent == root:
        return sorted(room.glob("*.py"))
    found = []
    for folder, inner, names in os.walk(room):
        inner[:] = [name for name in inner if name != "__pycache__"]
        found += [Path(folder, name) for name in names if name.endswith(".py")]
    return sorted(found)


@cache
def _text(file: Path) -> bytes:
    return file.read_bytes()


def reachable_files(root: Path, room: Path) -> list[Path]:
    """Every file of `room` and of the rooms that it imports at run time, directly or by another one."""
    found = {room: _files(root, room)}
    waiting = [room]
    while waiting:
        for file in found[waiting.pop()]:
            for other in _imported_rooms(root, file):
                if other not in found:
                    found[other] = _files(root, other)
                    waiting.append(other)
    return [file for place in sorted(found) for file in found[place]]


def _imported_rooms(root: Path, file: Path) -> Iterator[Path]:
    """Rooms of the imports at the beginning of a line: those within a function run nothing by being there."""
    for module in _IMPORTED.findall(_text(file).decode()):
        yield _room(root, module)


@cache
def _cache_folder(root: Path, room: Path) -> Path | None:
    """Where the machine code of a room is kept; None where nothing can be written."""
    digest = hashlib.sha256()
    for file in reachable_files(root, room):
        digest.update(_text(file))
    prefix = f"{'.'.join(room.relative_to(root).parts)}-kernels-"
    for base in _cache_places(room):
        with contextlib.suppress(OSError):
            folder = base / f"{prefix}{digest.hexdigest()[:16]}"
            folder.mkdir(parents=True, exist_ok=True)
            if os.access(folder, os.W_OK):
                forget_old_caches(folder, prefix, KEPT)
                return folder
    return None


def _cache_places(room: Path) -> Iterator[Path]:
    """NUMBA_CACHE_DIR if set, else beside the files, else (where these are read-only) the user's cache."""
    if _SETTINGS.CACHE_DIR:
        yield Path(_SETTINGS.CACHE_DIR)
        return
    yield room / "__pycache__"
    with contextlib.suppress(RuntimeError):  # a user without a home
        yield Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "servo-kernels"


def forget_old_caches(present: Path, prefix: str, kept: int) -> None:
    """Mark the folder `present` as used, and remove its elder siblings but the `kept` last used.

    A process that still runs an earlier version has loaded its kernels, or finds its folder among the kept.
    The parent may be shared with others, hence the `prefix`.
    """
    with contextlib.suppress(OSError):  # another process is doing the same
        os.utime(present)
        others = [folder for folder in present.parent.glob(f"{prefix}*") if folder != present]
        others.sort(key=lambda folder: folder.stat().st_mtime)
        for folder in others[: max(0, len(others) - kept)]:
            shutil.rmtree(folder, ignore_errors=True)
