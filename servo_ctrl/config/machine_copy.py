"""Copies a shipped machine, with its EDS files inside the copy."""

import re
import shutil
from pathlib import Path

from servo_ctrl.errors import ConfigError
from shipped_files import EDS, MACHINES, machine_names

SHIPPED_EDS_PREFIX, COPIED_EDS_PREFIX = re.compile(r'"(?:\.\./)+eds/'), '"eds/'
"""Prefixes of EDS paths in a shipped machine and in its copy."""


def copy_machine(name: str, directory: Path) -> None:
    """Copy machine `name` to `directory`, without learned results. Raises ConfigError, OSError."""
    if name not in machine_names():
        raise ConfigError(directory, "--from", f"no machine {name}; there are {', '.join(machine_names())}")
    if directory.exists():
        raise ConfigError(directory, "", "exists already; name a directory that does not")
    shutil.copytree(MACHINES / name, directory, ignore=shutil.ignore_patterns("learned", "__pycache__"))
    shutil.copytree(EDS, directory / "eds")
    template_eds = (MACHINES / name).parent / "eds"
    if template_eds.is_dir() and template_eds != EDS:
        shutil.copytree(template_eds, directory / "eds", dirs_exist_ok=True)
    for file in directory.glob("*.toml"):
        text = file.read_text(encoding="utf-8")
        file.write_text(SHIPPED_EDS_PREFIX.sub(COPIED_EDS_PREFIX, text), encoding="utf-8")
