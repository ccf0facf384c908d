"""The decorator of compiled functions, which are pure and equal for a single call and a batch.

Numba's disk cache checks only the file of the cached function: after a change in a file that the function
calls, the old machine code would still run. So the cache folder is named after the contents of every file
that a kernel can reach: the files of its room, of the rooms that these import, and so on. A room is a folder
two levels down (`servo_ctrl/control`), or the files directly in a package (`kernels`). The last used folders
of earlier contents stay.
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

import numpy as np

from kernels.lean_import import as_if_absent

with as_if_absent("scipy"):  # only for linear algebra in kernels, which is unused: 17 MB and 0.4 s
    import numba
    import numba.np.arraymath

F = TypeVar("F", bound="Callable[..., Any]")

PACKAGES = ("kernels", "can_frames", "servo_ctrl", "hil_sim", "twin", "reconcile", "studies")
"""Packages whose files determine the cache folder; numba itself checks the versions of libraries."""
KEPT_FOLDERS = 3
"""Earlier cache folders that stay, for another branch or a process that still runs; chosen."""
_ARRAY_TYPES: dict[tuple[Any, ...], Any] = {}
"""Numba's types by what they depend on: dtype, dimensions and flags."""
_SETTINGS: Any = numba.config
_IMPORTED = re.compile(rf"^(?:from|import) ((?:{'|'.join(PACKAGES)})\b[\w.]*)", re.MULTILINE)


def kernel(function: F) -> F:
    """Compile `function`, cached on disk, with numpy's arithmetic (x / 0 is inf).

    For the type checker the kernel is the original function. Fast-math is off, because the daemon, the
    simulator and the batch twin must give the same bits. Kernels that call it get a copy of its code: calls
    passed some hundred numbers through memory each period, in a third of a rollout's time.
    """
    return _compiled(function, nogil=False, forceinline=True)


def threaded_kernel(function: F) -> F:
    """Compile like `kernel`, without the interpreter lock, so that other threads run during long calls."""
    return _compiled(function, nogil=True)


def uncached_kernel(function: F) -> F:
    """Compile a closure over other kernels, without cache."""
    return cast("F", numba.njit(error_model="numpy")(function))


def ready_for(function: F, *arguments: Any) -> F:
    """Compile a kernel for the types of these arguments, or load it; return it for calls with such arguments.

    A call of the kernel itself checks the type of each argument first, which takes as long as the work of a
    cycle. The returned function does not, and reads an array of another type as if it were of this one: it is
    for callers that pass their own memory, whose types never change.
    """
    if _SETTINGS.DISABLE_JIT:
        return function
    dispatcher = cast("Any", function)
    return cast("F", dispatcher.compile(tuple(_type_of(dispatcher, argument) for argument in arguments)))


def _type_of(dispatcher: Any, argument: Any) -> Any:
    """Return numba's type of an argument; that of an array of records, which takes a millisecond, is kept."""
    if not isinstance(argument, np.ndarray):
        return dispatcher.typeof_pyval(argument)
    flags = argument.flags
    kind = (
        argument.dtype,
        argument.ndim,
        flags.c_contiguous,
        flags.f_contiguous,
        flags.writeable,
        flags.aligned,
    )
    if kind not in _ARRAY_TYPES:
        _ARRAY_TYPES[kind] = dispatcher.typeof_pyval(argument)
    return _ARRAY_TYPES[kind]


def signatures(function: Callable[..., Any]) -> int:
    """Return for how many combinations of argument types a kernel is compiled; it should be one."""
    return len(cast("Any", function).signatures)


def _compiled(function: F, *, nogil: bool, forceinline: bool = False) -> F:
    folder = _cache_folder(*_room_of(function))
    before = _SETTINGS.CACHE_DIR
    _SETTINGS.CACHE_DIR = str(folder or "")
    try:
        compiler = numba.njit(  # type: ignore[call-overload]  # numba's stubs lack no_cfunc_wrapper
            cache=folder is not None,
            error_model="numpy",
            nogil=nogil,
            forceinline=forceinline,
            no_cfunc_wrapper=True,  # C calls no kernel; a tenth of the compiler's work
        )
        return cast("F", compiler(function))
    finally:
        _SETTINGS.CACHE_DIR = before


def _room_of(function: Callable[..., Any]) -> tuple[Path, Path]:
    """Return the folder of our packages, and the room of a function in it."""
    file = Path(function.__code__.co_filename)
    root = file.parents[function.__module__.count(".")]
    return root, _room(root, function.__module__)


def _room(root: Path, module: str) -> Path:
    package, *inner = module.split(".")
    folder = root / package
    return folder / inner[0] if inner and (folder / inner[0]).is_dir() else folder


def _files(root: Path, room: Path) -> list[Path]:
    """Return the files of a room and its folders, except caches, which another process may delete."""
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
    """Return every file of `room` and of the rooms that it imports, directly or indirectly."""
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
    """Yield the rooms of a file's imports at the start of a line; imports in functions do not count."""
    for module in _IMPORTED.findall(_text(file).decode()):
        yield _room(root, module)


@cache
def _cache_folder(root: Path, room: Path) -> Path | None:
    """Return the folder for the machine code of a room; None if no folder is writable."""
    digest = hashlib.sha256()
    for file in reachable_files(root, room):
        digest.update(_text(file))
    prefix = f"{'.'.join(room.relative_to(root).parts)}-kernels-"
    for base in _cache_places(room):
        with contextlib.suppress(OSError):
            folder = base / f"{prefix}{digest.hexdigest()[:16]}"
            folder.mkdir(parents=True, exist_ok=True)
            if os.access(folder, os.W_OK):
                forget_old_caches(folder, prefix, KEPT_FOLDERS)
                return folder
    return None


def _cache_places(room: Path) -> Iterator[Path]:
    """Yield NUMBA_CACHE_DIR if set, else the folder of the files, then the user's cache folder."""
    if _SETTINGS.CACHE_DIR:
        yield Path(_SETTINGS.CACHE_DIR)
        return
    yield room / "__pycache__"
    with contextlib.suppress(RuntimeError):  # a user without a home
        yield Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "servo-kernels"


def forget_old_caches(present: Path, prefix: str, kept: int) -> None:
    """Mark the folder `present` as used, and remove all older ones except the `kept` last used.

    A process that still runs an earlier version has loaded its kernels or finds its folder among the kept.
    The `prefix` identifies our folders in a shared parent.
    """
    with contextlib.suppress(OSError):  # another process removes the same folders
        os.utime(present)
        others = [folder for folder in present.parent.glob(f"{prefix}*") if folder != present]
        others.sort(key=lambda folder: folder.stat().st_mtime)
        for folder in others[: max(0, len(others) - kept)]:
            shutil.rmtree(folder, ignore_errors=True)
