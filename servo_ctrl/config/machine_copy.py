"""Copies a shipped machine, with its EDS files inside the copy."""

import re
import shutil
from pathlib import Path

from servo_ctrl.errors import ConfigError
from shipped_files import EDS, MACHINES, machine_names

EDS_BESIDE, EDS_INSIDE = re.compile(r'"(?:\.\./)+eds/'), '"eds/'
"""Prefixes of EDS paths in a shipped machine and in its copy."""


def copy_machine(name: str, directory: Path) -> None:
    """Copy machine `name` to `directory`, without learned results. Raises ConfigError, OSError."""
    if name not in machine_names():
        raise ConfigError(directory, "--from", f"no machine {name}; there are {', '.join(machine_names())}")
    if directory.exists():
        raise ConfigError(directory, "", "exists already; name a directory that does not")
    shutil.copytree(MACHINES / name, directory, ignore=shutil.ignore_patterns("learned", "__pycache__"))
    shutil.copytree(EDS, directory / "eds")
    own = (MACHINES / name).parent / "eds"  # EDS files of the templates
    if own.is_dir() and own != EDS:
        shutil.copytree(own, directory / "eds", dirs_exist_ok=True)
    for file in directory.glob("*.toml"):
        text = file.read_text(encoding="utf-8")
        file.write_text(EDS_BESIDE.sub(EDS_INSIDE, text), encoding="utf-8")
