"""A TOML file as it is, or why it cannot be read."""

from __future__ import annotations

import tomllib
from typing import TYPE_CHECKING, Any

from reconcile.errors import ReconcileError

if TYPE_CHECKING:
    from pathlib import Path


def document_of(file: Path) -> dict[str, Any]:
    """All that is in it. Raises ReconcileError."""
    try:
        return tomllib.loads(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise ReconcileError(file, "", error.strerror or "cannot be read") from None
    except (ValueError, RecursionError) as error:  # no UTF-8, no TOML; a number or a nesting without end
        raise ReconcileError(file, "", f"not TOML: {error}") from None
