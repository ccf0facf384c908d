"""Loads TOML files into checked types; every error becomes one ConfigError with file and key."""

import hashlib
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from kernels.validation_messages import plain_message
from servo_ctrl.config.contour import contour_objection
from servo_ctrl.config.file_format import format_problem
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.config.part_program import ReadingOptions, is_part_program
from servo_ctrl.config.part_program_reader import read_part_program
from servo_ctrl.config.program_model import ProgramConfig, SamplesStep, StepConfig, axes_of, step_key
from servo_ctrl.errors import ConfigError
from shipped_files import machine_names

MACHINE_FILE = "controller.toml"
FILE_KINDS = {"machine": "a controller file", "plant": "the plant file of a simulator", "step": "a program"}
"""The kind of a file, by a section that only this kind has."""
FOREIGN_SUFFIXES = {
    ".eds": "an EDS file",
    ".dcf": "a DCF file",
    ".ngc": "G-code",
    ".nc": "G-code",
    ".json": "a JSON file",
}
"""What a file that is not TOML contains, by its suffix."""
FILE_KEYS = frozenset({"eds", "concise_dcf", "password_file", "ca_file", "cert_file", "key_file"})
"""Keys of a machine file whose paths are relative to the file."""


def load_machine(directory_or_file: Path | str) -> MachineConfig:
    """Load the machine from `controller.toml` in a directory, or from the file itself.

    Paths, which the file gives relative to itself, become absolute. Raises ConfigError.
    """
    path = Path(directory_or_file)
    if path.is_dir():
        path /= MACHINE_FILE
    elif not path.exists() and not path.suffix:
        names = ", ".join(name for name in machine_names() if "/" not in name)
        raise ConfigError(path, "", f"no such directory; machines that come with the programs: {names}")
    document, digest = _read(path)
    _check_document(path, document)
    _refuse_other_kind(path, document, "machine", "--machine takes a directory with controller.toml")
    _resolve_paths(document, path)
    try:
        machine = MachineConfig.model_validate({**document, "source": path, "source_sha256": digest})
    except ValidationError as error:
        raise as_config_error(path, error) from None
    if objection := contour_objection(machine):
        key, _, reason = objection.partition(": ")
        raise ConfigError(path, f"contour_control.{key}", reason)
    return machine


def load_program(
    path: Path | str,
    machine: MachineConfig,
    inputs: Mapping[str, Path] | None = None,
    reading: ReadingOptions | None = None,
) -> ProgramConfig:
    """Load a program for `machine`: G-code (a `PartProgram`) or TOML, by the file name. Raises ConfigError.

    `inputs`: files for steps that name an `input`. `reading`: options of the G-code reader.
    `servo_ctrl.config.program.check_program` checks the limits.
    """
    path = Path(path)
    if path.is_dir():
        raise ConfigError(path, "", "this is a directory, --program takes a file with steps or G-code")
    if is_part_program(path):
        return read_part_program(path, list(machine.axes), reading)
    document = read_toml(path)
    _check_document(path, document)
    _refuse_other_kind(path, document, "step", "--program takes a file with steps, or G-code")
    try:
        program = ProgramConfig.model_validate({**document, "source": path})
    except ValidationError as error:
        raise as_config_error(path, error, document) from None
    files = {name: Path(file) for name, file in (inputs or {}).items()}
    steps = [_with_file(path, index, step, files) for index, step in enumerate(program.steps)]
    for index, step in enumerate(steps):
        for key, axis in axes_of(step):
            if axis not in machine.axes:
                known = ", ".join(machine.axes)
                reason = f'machine {machine.machine.name} has no axis "{axis}", only {known}'
                raise ConfigError(path, f"{step_key(index, step.label)}.{key}", reason)
    return program.model_copy(update={"steps": steps})


def _check_document(path: Path, document: dict[str, Any]) -> None:
    """Check and remove the key `format`, and refuse the keys that loading adds. Raises ConfigError."""
    for added in ("source", "source_sha256"):
        if added in document:
            raise ConfigError(path, added, "unknown key")
    if problem := format_problem(document.pop("format", None)):
        raise ConfigError(path, "format", problem)


def _refuse_other_kind(path: Path, document: Mapping[str, Any], section: str, wanted: str) -> None:
    """Raise ConfigError if a file lacks `section` but has that of another kind of file."""
    kind = next((kind for other, kind in FILE_KINDS.items() if other in document and other != section), None)
    if section not in document and kind:
        raise ConfigError(path, "", f"this is {kind}, {wanted}")


def _with_file(path: Path, index: int, step: StepConfig, inputs: Mapping[str, Path]) -> StepConfig:
    """Resolve the file of a step with samples; other steps stay as they are."""
    if not isinstance(step, SamplesStep):
        return step
    if step.file is not None:
        return step.model_copy(update={"file": _absolute_path(path, step.file)})
    if step.input is None or step.input not in inputs:
        reason = f'no file was given for input "{step.input}"'
        raise ConfigError(path, f"{step_key(index, step.label)}.input", reason)
    return step.model_copy(update={"file": inputs[step.input].resolve(), "input": None})


def read_toml(path: Path) -> dict[str, Any]:
    """Return the document in `path`. Raises ConfigError when it is absent, unreadable or no TOML."""
    return _read(path)[0]


def _read(path: Path) -> tuple[dict[str, Any], str]:
    """Return the document in `path` and the SHA-256 of the file that was read. Raises ConfigError."""
    try:
        content = path.read_bytes()
        return tomllib.loads(content.decode("utf-8")), hashlib.sha256(content).hexdigest()
    except FileNotFoundError:
        raise ConfigError(path, "", "no such file") from None
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(path, "", f"cannot be read: {error}") from None
    except (ValueError, RecursionError) as error:  # also for huge numbers and deep nesting
        what = FOREIGN_SUFFIXES.get(path.suffix.lower())
        reason = f"this is {what}, which is not accepted here" if what else f"not valid TOML: {error}"
        if not what and b"\r" in content and b"\n" not in content:
            reason = "its lines end with CR alone, which is not valid TOML: save the file with LF or CR LF"
        raise ConfigError(path, "", reason) from None


def as_config_error(
    path: Path, error: ValidationError, document: Mapping[str, Any] | None = None
) -> ConfigError:
    """Convert the first error of pydantic to a ConfigError, with the number of further ones."""
    details = error.errors(include_url=False, include_context=True)
    first = details[0]
    key = _key_of(first, document or {})
    reason = _reason_of(first)
    if first["type"] == "value_error" and isinstance(first["input"], dict):
        # the text of a check across several keys begins with the key
        subkey, separator, rest = reason.partition(": ")
        if separator:
            key, reason = ".".join(part for part in (key, subkey) if part), rest
    if len(details) > 1:
        reason = f"{reason} (and {len(details) - 1} more)"
    return ConfigError(path, key, reason)


def _key_of(detail: ErrorDetails, document: Mapping[str, Any]) -> str:
    """Return the place in the file, such as `axis.x.limits.force_n` or `step[2] "F 500".radius_mm`."""
    location = [part for part in detail["loc"] if part != "[key]"]
    head = ""
    if len(location) > 1 and location[0] == "step" and isinstance(location[1], int):
        # pydantic adds the kind of the step as third part, which is not a key in the file
        step = document["step"][location[1]]
        label = step.get("label", step.get("kind", "")) if isinstance(step, dict) else ""
        head, location = step_key(location[1], str(label)), location[3:]
    suffixes = [f"[{part + 1}]" if isinstance(part, int) else f".{part}" for part in location]
    return (head + "".join(suffixes)).removeprefix(".")


def _reason_of(detail: ErrorDetails) -> str:
    context = detail.get("ctx", {})
    match detail["type"]:
        case "missing":
            reason = "is missing"
        case "extra_forbidden" | "unexpected_keyword_argument":
            reason = "unknown key"
        case "union_tag_invalid":
            reason = f"kind {context['tag']!r} is not one of {context['expected_tags']}"
        case "union_tag_not_found":
            reason = "kind is missing"
        case "literal_error":
            reason = f"{detail['input']!r} is not one of {context['expected']}"
        case "value_error":
            reason = str(context["error"])
        case _:
            reason = f"{plain_message(detail['msg'])} (got {detail['input']!r})"
    return reason


def _resolve_paths(document: dict[str, Any], path: Path) -> None:
    """Make every path absolute, in place; the validation reports ill-formed values."""
    for key, value in document.items():
        if isinstance(value, dict):
            _resolve_paths(value, path)
        elif key in FILE_KEYS and isinstance(value, str):
            document[key] = _absolute_path(path, value)


def _absolute_path(path: Path, name: Path | str) -> Path:
    """Return the absolute path of a file that `path` names relative to itself."""
    try:
        return (path.resolve().parent / name).resolve()
    except (OSError, RuntimeError, ValueError) as error:  # a loop of links, or a NUL in the name
        raise ConfigError(path, "", f"{str(name)!r} is not a file name: {error}") from None
