"""Lists and fetches the recordings of a fleet: Parquet partitioned as `machine=NAME/axis=NAME/...`.

Only this file uses fsspec, which reads local directories and object stores alike. A listing is compact,
because it holds up to a hundred thousand axes.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import unquote

from reconcile.errors import ReconcileError

HEADER = "recording.json"
"""The file that marks its directory as one recording of several parts, of `servo-ctrl run --record`."""
VERSION_KEYS = (
    *("ETag", "etag", "md5Hash", "content_md5"),
    *("mtime", "LastModified", "last_modified", "updated", "created"),
)
"""Keys under which file systems report the version of a file, the most specific first."""
INSTALL = "pip install 'servo-ctrl[fleet]'"


class DataFile(NamedTuple):
    """One file; `path` is relative to the directory of its axis."""

    path: str
    size: int
    version: str
    """ETag, or time of the last change."""


class AxisData(NamedTuple):
    """The recordings of one axis of one machine."""

    machine: str
    axis: str
    root: str
    """URL of its directory, without credentials, from which a worker reads."""
    files: tuple[DataFile, ...]

    @property
    def name(self) -> str:
        """The name in messages; unique in the fleet."""
        return f"{self.machine}/{self.axis}"

    @property
    def bytes(self) -> int:
        """The size of all its files."""
        return sum(file.size for file in self.files)


class Listing(NamedTuple):
    """The axes of a dataset, and the names of files that belong to no axis or are not Parquet."""

    axes: list[AxisData]
    ignored: list[str]


def list_dataset(url: str) -> Listing:
    """List the axes of a dataset by name, without opening a file. Raises ReconcileError."""
    system, root = _open_filesystem(url)
    try:
        entries = sorted(system.ls(root, detail=True), key=lambda entry: str(entry["name"]))
    except FileNotFoundError:
        raise ReconcileError(url, "", "there is no such directory") from None
    except NotADirectoryError:
        raise ReconcileError(url, "", "is a file; the directory of the dataset is wanted") from None
    except Exception as error:  # every kind of store raises its own
        raise ReconcileError(url, "", f"cannot be listed: {error}") from error
    found: dict[tuple[str, str], AxisData] = {}
    ignored: list[str] = []
    machines = [str(entry["name"]) for entry in entries if _is_machine(entry)]
    ignored += [str(entry["name"]) for entry in entries if not _is_machine(entry) and not _hidden(entry)]
    for directory in machines:
        try:
            files = system.find(directory, detail=True)
        except Exception as error:  # as above
            raise ReconcileError(directory, "", f"cannot be listed: {error}") from error
        for axis in _axes(system, directory, files, ignored):
            if axis.files:
                found[axis.machine, axis.axis] = axis
    if not found:
        remedy = "recordings lie in machine=NAME/axis=NAME/FILE.parquet"
        raise ReconcileError(url, "", "holds no recordings by machine and axis", remedy)
    return Listing([found[name] for name in sorted(found)], ignored)


def fetch_recordings(axis: AxisData, directory: Path) -> list[Path]:
    """Return local paths of the recordings; remote ones are copied to `directory`. Raises OSError."""
    system, root = _open_filesystem(axis.root)
    base = Path(root)
    if not _is_local(system):
        base = directory
        for file in axis.files:
            target = directory / file.path
            target.parent.mkdir(parents=True, exist_ok=True)
            system.get_file(f"{root}/{file.path}", str(target))
    paths = [Path(file.path) for file in axis.files]
    multipart = {path.parent for path in paths if path.name == HEADER}
    names = {str(path.parent if path.parent in multipart else path) for path in paths}
    return [base / name for name in sorted(names)]


def _open_filesystem(url: str) -> tuple[Any, str]:
    try:
        from fsspec.core import url_to_fs  # noqa: PLC0415  # an extra of the installation
    except ImportError:
        raise ReconcileError("reconcile fleet", "", "fsspec is not installed", INSTALL) from None
    try:
        system, root = url_to_fs(url)
    except (ImportError, ValueError, OSError) as error:
        remedy = "s3:// needs s3fs, gs:// gcsfs, abfs:// adlfs, here and in the environment of every worker"
        raise ReconcileError(url, "", f"cannot be opened: {error}", remedy) from None
    return system, str(root).rstrip("/")


def _is_local(system: Any) -> bool:
    protocols = system.protocol if isinstance(system.protocol, tuple | list) else (system.protocol,)
    return "file" in protocols


def _is_machine(entry: dict[str, Any]) -> bool:
    return entry["type"] == "directory" and _value(Path(str(entry["name"])).name, "machine") is not None


def _hidden(entry: dict[str, Any]) -> bool:
    """Return whether it is a file that tools leave beside data (`_SUCCESS`, `.crc`)."""
    return Path(str(entry["name"])).name.startswith(("_", "."))


def _value(part: str, key: str) -> str | None:
    """Return the value of a partition directory `key=value`; None for anything else or an unusable name."""
    name, equals, value = part.partition("=")
    value = unquote(value)
    return value if name == key and equals and value.strip() and value not in {".", ".."} else None


def _axes(
    system: Any, directory: str, files: dict[str, dict[str, Any]], ignored: list[str]
) -> Iterator[AxisData]:
    machine = _value(Path(directory).name, "machine") or ""
    by_axis: dict[str, list[DataFile]] = {}
    for name, facts in sorted(files.items()):
        below = name.removeprefix(directory.rstrip("/") + "/")
        part, _, path = below.partition("/")
        hidden = any(piece.startswith(("_", ".")) for piece in path.split("/"))
        if _value(part, "axis") is None or hidden or not path.endswith((".parquet", f"/{HEADER}")):
            ignored.append(name)
        else:
            by_axis.setdefault(part, []).append(DataFile(path, int(facts["size"]), _version(facts)))
    for part, found in by_axis.items():
        root = str(system.unstrip_protocol(f"{directory}/{part}"))
        yield AxisData(machine, _value(part, "axis") or "", root, tuple(found))


def _version(facts: dict[str, Any]) -> str:
    return next((str(facts[key]) for key in VERSION_KEYS if facts.get(key) is not None), "")
