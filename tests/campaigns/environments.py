"""Environments of their own for programs that are not dependencies of ours; each is made once."""

import subprocess
import sys
import sysconfig
import venv
from pathlib import Path


def environment(place: Path, packages: tuple[str, ...], *, ours: bool = False) -> Path:
    """Return `bin` of an environment with the packages; with `ours` it sees the packages that we have."""
    binaries, ready = place / "bin", place / "ready"
    if ready.exists() and ready.read_text(encoding="utf-8") == repr(packages):
        return binaries
    venv.create(place, with_pip=True, symlinks=True, clear=True)
    if ours:
        found = Path(sysconfig.get_path("purelib", vars={"base": str(place)}))
        line = f"import site; site.addsitedir({sysconfig.get_path('purelib')!r})\n"
        (found / "ours.pth").write_text(line, encoding="utf-8")
    command = [str(binaries / "pip"), "install", "--quiet", *packages]
    subprocess.run(command, check=True, stdout=sys.stderr)
    ready.write_text(repr(packages), encoding="utf-8")
    return binaries
