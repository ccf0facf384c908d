"""Fuzz targets: files of users, and files of this software that were changed."""

import functools
import json
from collections.abc import Callable, Sequence
from pathlib import Path

from journal_examples import SETTINGS

from hil_sim.config import ConfigError as PlantError
from hil_sim.config import load_plant
from hil_sim.node import storage
from hil_sim.node.dictionary import Dictionary
from reconcile.errors import ReconcileError
from reconcile.nominal_model.model_file import load_model
from servo_ctrl.config.load import load_machine, load_program
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.config.program import check_program
from servo_ctrl.errors import ConfigError, ServoCtrlError
from servo_ctrl.hmi.access.users import Access
from servo_ctrl.learned.file_model import LearnedFile
from servo_ctrl.learned.pulse_model import LearnedFunctions
from servo_ctrl.learned.screw_model import ScrewTable
from servo_ctrl.learned.store import LearnedStore
from servo_ctrl.learned.stroke_journal import JOURNAL_FILE, StrokeJournal
from servo_ctrl.recording.reversal_log import REVERSALS_FILE, read_reversals
from tests.campaigns.hostile.targets import GOLDEN, ROOT, file_with, folder, target

TABLE = GOLDEN / "machines" / "xy_table"


def of(*paths: Path) -> Callable[[], Sequence[bytes]]:
    """Return a function that reads files as seeds."""
    return lambda: [path.read_bytes() for path in paths]


@functools.cache
def xy_table() -> MachineConfig:
    """Return the machine of the programs."""
    return load_machine(TABLE)


@target("servo_ctrl.config.load", of(TABLE / "controller.toml"), declared=ConfigError, short=150)
def machine_toml(data: bytes) -> None:
    load_machine(file_with(data, "controller.toml"))


@target("hil_sim.config.load", of(TABLE / "plant.toml"), declared=PlantError, short=150)
def plant_toml(data: bytes) -> None:
    load_plant(file_with(data, "plant.toml"))


@target(
    "reconcile.nominal_model.model_file",
    of(TABLE / "plant.toml", GOLDEN / "diagnosis" / "model.toml"),
    declared=ReconcileError,
)
def model_toml(data: bytes) -> None:
    load_model(file_with(data, "model.toml"))


@target(
    "servo_ctrl.config.program_model",
    of(TABLE / "programs" / "circles.toml"),
    declared=ConfigError,
    short=150,
)
def program_toml(data: bytes) -> None:
    check_program(load_program(file_with(data, "program.toml"), xy_table()), xy_table())


@target(
    "servo_ctrl.motion.gcode.blocks",
    of(TABLE / "programs" / "bracket.ngc"),
    declared=ConfigError,
    words=(
        b"G2 X1 Y1 I1 J0",
        b"G64 P0.01",
        b"G4 P1",
        b"(",
        b";",
        b"M30",
        b"F0",
        b"G91",
        b"R1e9",
        b"#1=2",
        b"%",
    ),
)
def part_program(data: bytes) -> None:
    load_program(file_with(data, "part.ngc"), xy_table())


def _learned() -> Sequence[bytes]:
    return [(GOLDEN / "learned" / "x" / "v0001.json").read_bytes()]


@target("servo_ctrl.learned.file_model", _learned, declared=ValueError)
def learned_functions(data: bytes) -> None:
    """Read a learned file; the checksum of JSON input is corrected, so that its content is parsed too."""
    found = LearnedFile[LearnedFunctions].from_text(_sealed(data))
    found.objection(xy_table(), "x")


@target(
    "servo_ctrl.learned.screw_model",
    of(GOLDEN / "learned" / "x" / "screw" / "v0001.json"),
    declared=ValueError,
)
def learned_screw(data: bytes) -> None:
    LearnedFile[ScrewTable].from_text(_sealed(data)).objection(xy_table(), "x")


def _sealed(data: bytes) -> str:
    text = data.decode("utf-8", "replace")
    try:
        document = json.loads(text)
        content = {key: value for key, value in document.items() if key != "sha256"}
        from servo_ctrl.learned.file_model import _digest  # noqa: PLC0415

        return json.dumps({**content, "sha256": _digest(content)})
    except (ValueError, AttributeError, RecursionError):
        return text


def _active_and_learned() -> Sequence[bytes]:
    return [(GOLDEN / "learned" / "x" / "active.json").read_bytes() + b"\n\n\n" + _learned()[0]]


@target("servo_ctrl.learned.store", _active_and_learned, declared=ServoCtrlError, short=150)
def learned_version_on_the_disk(data: bytes) -> None:
    """Read a store whose `active.json` and version are the two halves of the input."""
    active, _, version = data.partition(b"\n\n\n")
    file_with(version or data, "learned/x/v0001.json")
    file_with(active, "learned/x/active.json")
    store = LearnedStore(folder() / "learned", xy_table())
    store.versions("x")
    store.active("x")


@target(
    "servo_ctrl.learned.journal_lines",
    of(GOLDEN / "learned" / "x" / "journal.jsonl"),
    declared=ServoCtrlError,
)
def stroke_journal(data: bytes) -> None:
    file_with(data, f"journal/x/{JOURNAL_FILE}")
    StrokeJournal(folder() / "journal", "x", SETTINGS).replay()


@target(
    "servo_ctrl.recording.reversal_log", of(GOLDEN / "recording" / REVERSALS_FILE), declared=ServoCtrlError
)
def reversal_log(data: bytes) -> None:
    file_with(data, f"reversals/{REVERSALS_FILE}")
    read_reversals(folder() / "reversals")


@target("servo_ctrl.hmi.access.users", of(GOLDEN / "access.toml"), declared=ConfigError)
def access_file(data: bytes) -> None:
    path = file_with(data, "access.toml")
    path.chmod(0o600)
    Access(path).owner_of("x" * 43)


@target("hil_sim.node.storage", of(GOLDEN / "node_1.json"), declared=storage.StoredParametersError)
def stored_parameters(data: bytes) -> None:
    kept = storage.Storage(_drive(), file_with(data, "node_1.json"), lambda: True)
    kept.load(0x1000, 0xFFFF)


@functools.cache
def _drive() -> Dictionary:
    from hil_sim.drive.drive_objects import DriveObjects  # noqa: PLC0415

    # its EDS is of an earlier release: what it has not yet is inside
    return Dictionary(1, GOLDEN / "eds" / "servo_drive.eds", DriveObjects(), ROOT / "eds" / "servo_drive.eds")
