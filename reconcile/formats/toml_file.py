"""TOML files: reading, absolute paths in model files, and the text of documents (tomli_w behind one file)."""

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import tomli_w

from reconcile.errors import ReconcileError


def document_of(file: Path) -> dict[str, Any]:
    """Read a TOML file. Raises ReconcileError."""
    try:
        return tomllib.loads(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise ReconcileError(file, "", error.strerror or "cannot be read") from None
    except (ValueError, RecursionError) as error:  # no UTF-8, no TOML; a number or a nesting without end
        raise ReconcileError(file, "", f"not TOML: {error}") from None


def with_absolute_paths(document: Mapping[str, Any], directory: Path) -> dict[str, Any]:
    """Return a model document whose EDS paths, relative to `directory`, are absolute."""

    def absolute(section: Any) -> Any:
        if isinstance(section, Mapping) and isinstance(section.get("eds"), str):
            return {**section, "eds": str((directory / section["eds"]).resolve())}
        return section

    axes = {
        name: {key: absolute(section) for key, section in axis.items()} if isinstance(axis, Mapping) else axis
        for name, axis in document["axis"].items()
    }
    return {**document, "axis": axes}


def toml_text(document: Mapping[str, Any]) -> str:
    """Write a document as TOML text."""
    return tomli_w.dumps(document)
