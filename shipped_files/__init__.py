"""The EDS files and machines that come with the programs, wherever these are installed.

In a checkout `eds/` and `machines/` lie at its top; the wheel carries both inside this package, beside each
other as there, so that the relative paths of a machine's files hold in either place.
"""

import os
from pathlib import Path

PACKAGE = Path(__file__).resolve().parent
ROOT = PACKAGE if (PACKAGE / "eds").is_dir() else PACKAGE.parent
"""Holds `eds/` and `machines/`."""
EDS, MACHINES = ROOT / "eds", ROOT / "machines"


def machine_names() -> list[str]:
    """Return the names of the machines that come with the programs."""
    files = (*MACHINES.glob("*/controller.toml"), *MACHINES.glob("templates/*/controller.toml"))
    return sorted(str(file.parent.relative_to(MACHINES)) for file in files)


def shipped(given: Path) -> Path:
    """Return `given` where it exists or nothing else is meant, else what is shipped by that name.

    Names are `xy_table` and `machines/xy_table/programs/circles.toml`.

    The user's own files come first; a shipped machine is found from every working directory.
    """
    if given.exists() or given.is_absolute() or ".." in given.parts:
        return given
    below = given.parts[1:] if given.parts[:1] == (MACHINES.name,) else given.parts
    found = MACHINES.joinpath(*below)
    return found if below and found.exists() else given


def shipped_or_none(given: Path | None) -> Path | None:
    """Return `shipped` of an option that may be left out."""
    return None if given is None else shipped(given)


def is_installed(path: Path) -> bool:
    """Whether a path lies inside the installed package, where nothing may be written."""
    return ROOT == PACKAGE and path.resolve().is_relative_to(PACKAGE)


def state_directory() -> Path:
    """Return where the user's programs may keep what they learn, by the XDG Base Directory Specification."""
    given = Path(os.environ.get("XDG_STATE_HOME", ""))
    base = (
        given if given.is_absolute() else Path.home() / ".local" / "state"
    )  # a relative one is to be ignored
    return base / "servo_ctrl"
