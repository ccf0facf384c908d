"""Files of a dataset are found in each kind of storage, and each axis has its model."""

import tomllib
from pathlib import Path

import fsspec
import pytest

from reconcile.errors import ReconcileError
from reconcile.fleet.dataset import fetch_recordings, list_dataset
from reconcile.fleet.models import FleetModels

AXIS = "transmission.lead_mm = 5.0\nmotor.torque_constant_nm_a = 0.4\ntable.mass_kg = {mass}\n"


def files(root: Path, *names: str) -> None:
    for name in names:
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_bytes(name.encode())


def test_axes_are_found_by_directory_and_other_files_are_reported(tmp_path: Path) -> None:
    files(
        tmp_path,
        "machine=b/axis=x/1.parquet",
        "machine=a%2F1/axis=y/day=2/2.parquet",
        "machine=a%2F1/axis=y/day=1/1.parquet",
        "machine=a%2F1/axis=y/_SUCCESS",
        "machine=a%2F1/loose.parquet",
        "machine=../axis=x/1.parquet",
        "notes.txt",
    )
    found = list_dataset(str(tmp_path))
    assert [(one.machine, one.axis) for one in found.axes] == [("a/1", "y"), ("b", "x")]
    assert [file.path for file in found.axes[0].files] == ["day=1/1.parquet", "day=2/2.parquet"]
    assert {Path(name).name for name in found.ignored} >= {"loose.parquet", "notes.txt", "_SUCCESS"}


def test_a_recording_of_the_daemon_is_one_recording(tmp_path: Path) -> None:
    place = "machine=a/axis=x"
    files(tmp_path, f"{place}/run/recording.json", f"{place}/run/part-00000.parquet", f"{place}/one.parquet")
    (axis,) = list_dataset(str(tmp_path)).axes
    assert [path.name for path in fetch_recordings(axis, tmp_path / "unused")] == ["one.parquet", "run"]


def test_remote_files_are_downloaded(tmp_path: Path) -> None:
    store = fsspec.filesystem("memory")
    store.pipe_file("/fleet/machine=m/axis=x/a.parquet", b"one")
    store.pipe_file("/fleet/machine=m/axis=x/deep/b.parquet", b"two")
    try:
        (axis,) = list_dataset("memory://fleet").axes
        paths = fetch_recordings(axis, tmp_path)
        assert axis.root.startswith("memory://")
        assert [path.relative_to(tmp_path).as_posix() for path in paths] == ["a.parquet", "deep/b.parquet"]
        assert [path.read_bytes() for path in paths] == [b"one", b"two"]
        assert axis.bytes == 6
    finally:
        store.rm("/fleet", recursive=True)


@pytest.mark.parametrize(
    ("url", "reason"),
    [
        ("nowhere", "there is no such directory"),
        ("empty", r"holds no recordings.*machine=NAME/axis=NAME/FILE\.parquet"),
        ("nosuch://bucket", "cannot be opened: Protocol not known"),
    ],
)
def test_an_invalid_dataset_is_reported(tmp_path: Path, url: str, reason: str) -> None:
    (tmp_path / "empty").mkdir()
    with pytest.raises(ReconcileError, match=reason):
        list_dataset(url if "://" in url else str(tmp_path / url))


def model(text: str, axis: str) -> float:
    return float(tomllib.loads(text)["axis"][axis]["table"]["mass_kg"])


def test_the_closest_model_is_taken(tmp_path: Path) -> None:
    files(tmp_path, "m1/x.toml")
    (tmp_path / "m1/x.toml").write_text("[axis.q]\n" + AXIS.format(mass=1))
    (tmp_path / "m1.toml").write_text(f"[axis.x]\n{AXIS.format(mass=2)}[axis.y]\n{AXIS.format(mass=3)}")
    (tmp_path / "default.toml").write_text("[axis.any]\n" + AXIS.format(mass=4))
    models = FleetModels(tmp_path)
    assert model(models.of("m1", "x").text, "x") == 1.0
    assert model(models.of("m1", "y").text, "y") == 3.0
    assert list(tomllib.loads(models.of("m1", "y").text)["axis"]) == ["y"]
    assert model(models.of("m2", "z").text, "z") == 4.0
    assert model(models.of("../m1", "y").text, "y") == 4.0
    with pytest.raises(ReconcileError, match=r"m1\.toml: axis: there is no axis z; it has x, y"):
        models.of("m1", "z")


def test_an_axis_without_a_model_is_reported_with_the_searched_places(tmp_path: Path) -> None:
    (tmp_path / "bad.toml").write_text("[axis")
    models = FleetModels(tmp_path)
    wanted = r"no model of m/x; looked for m/x\.toml, m\.toml, default\.toml"
    with pytest.raises(ReconcileError, match=wanted):
        models.of("m", "x")
    with pytest.raises(ReconcileError, match="not TOML"):
        models.of("bad", "x")
    with pytest.raises(ReconcileError, match="no such directory of models"):
        FleetModels(tmp_path / "none")


def test_a_model_resolves_its_eds_path_from_its_own_directory(tmp_path: Path) -> None:
    drive = '[axis.x.drive]\nnode_id = 1\neds = "../eds/servo.eds"\n'
    (tmp_path / "m.toml").write_text(f"[axis.x]\n{AXIS.format(mass=2)}{drive}")
    text = FleetModels(tmp_path).of("m", "x").text
    assert tomllib.loads(text)["axis"]["x"]["drive"]["eds"] == str(tmp_path.parent / "eds" / "servo.eds")
