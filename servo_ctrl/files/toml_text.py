"""Documents as TOML text: tomli_w behind one file."""

from collections.abc import Mapping
from typing import Any

import tomli_w


def toml_text(document: Mapping[str, Any]) -> str:
    """Write a document as TOML text."""
    return tomli_w.dumps(document)
