"""Documents as TOML text: tomli_w behind one file."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import tomli_w

if TYPE_CHECKING:
    from collections.abc import Mapping


def toml_text(document: Mapping[str, Any]) -> str:
    """Write a document as TOML text."""
    return tomli_w.dumps(document)
