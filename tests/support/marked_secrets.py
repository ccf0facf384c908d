"""A secret that can be recognised in any output, also encoded."""

import base64
import secrets
from collections.abc import Iterable
from pathlib import Path
from urllib.parse import quote


class MarkedSecret:
    """One secret; `text` is the value that the product receives."""

    def __init__(self, text: str = "") -> None:
        self.text = text or f"marked/{secrets.token_urlsafe(18)}"
        plain = self.text.encode()
        inner = base64.b64encode(plain[: len(plain) - len(plain) % 3])
        self._forms = {plain, quote(self.text, safe="").encode(), inner, plain.hex().encode()}

    def in_bytes(self, content: bytes) -> bool:
        """Return whether the secret occurs: plain, percent-encoded, in base64 or hexadecimal."""
        return any(form in content for form in self._forms)

    def in_files(self, folder: Path, but: Iterable[Path] = ()) -> list[Path]:
        """Return the files below a folder whose content or name contains the secret."""
        left_out = set(but)
        files = [path for path in folder.rglob("*") if path.is_file() and path not in left_out]
        return [path for path in files if self.in_bytes(str(path).encode() + path.read_bytes())]
