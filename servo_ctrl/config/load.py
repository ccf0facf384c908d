"""TOML files into checked types; whatever is wrong comes out as one ConfigError with file and key."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import ValidationError

from servo_ctrl.config.errors import ConfigError
from servo_ctrl.config.model import MachineConfig

if TYPE_CHECKING:
    from pydantic_core import ErrorDetails

MACHINE_FILE = "controller.toml"


def load_machine(directory_or_file: Path | str) -> MachineConfig:
    """The machine described by `controller.toml` in a directory, or by the file itself.

    EDS paths come back absolute (they are written relative to the file). Raises ConfigError.
    """
    path = Path(directory_or_file)
    if path.is_dir():
        path /= MACHINE_FILE
    document = read_toml(path)
    if "source" in document:
        raise ConfigError(path, "source", "unknown key")
    _resolve_eds_paths(document, path.resolve().parent)
    try:
        return MachineConfig.model_validate({**document, "source": path})
    except ValidationError as error:
        raise as_config_error(path, error) from None


def read_toml(path: Path) -> dict[str, Any]:
    """The document in `path`; raises ConfigError when it is absent, unreadable or no TOML."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise ConfigError(path, "", "no such file") from None
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(path, "", f"cannot be read: {error}") from None
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(path, "", f"not valid TOML: {error}") from None


def as_config_error(path: Path, error: ValidationError) -> ConfigError:
    """The first complaint of pydantic in the user's terms, and how many more there are."""
    details = error.errors(include_url=False, include_context=True)
    first = details[0]
    key = _key_of(first)
    reason = _reason_of(first)
    if first["type"] == "value_error" and isinstance(first["input"], dict | MachineConfig):
        # a check across keys: it begins with the key it complains about
        inner, separator, rest = reason.partition(": ")
        if separator:
            key, reason = ".".join(part for part in (key, inner) if part), rest
    more = f" (and {len(details) - 1} more)" if len(details) > 1 else ""
    return ConfigError(path, key, reason + more)


def _key_of(detail: ErrorDetails) -> str:
    parts = [f"[{part + 1}]" if isinstance(part, int) else f".{part}" for part in detail["loc"]]
    return "".join(parts).removeprefix(".")


def _reason_of(detail: ErrorDetails) -> str:
    match detail["type"]:
        case "missing":
            return "is missing"
        case "extra_forbidden":
            return "unknown key"
        case "value_error":
            return str(detail["ctx"]["error"])
        case _:
            message = detail["msg"][0].lower() + detail["msg"][1:]
            return f"{message} (got {detail['input']!r})"


def _resolve_eds_paths(document: dict[str, Any], directory: Path) -> None:
    """Make every `eds` value absolute, in place; anything ill-formed is left for the validation."""
    for key, value in document.items():
        if isinstance(value, dict):
            _resolve_eds_paths(value, directory)
        elif key == "eds" and isinstance(value, str):
            document[key] = (directory / value).resolve()
