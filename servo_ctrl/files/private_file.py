"""Files that hold a secret: for their owner only, or they are not used."""

import stat
from pathlib import Path

from servo_ctrl.errors import ConfigError


def refuse_readable_for_others(path: Path) -> None:
    """Raise ConfigError unless this is a file that its owner alone may read."""
    try:
        mode = path.stat().st_mode
    except FileNotFoundError:
        raise ConfigError(path, "", "no such file") from None
    except OSError as error:
        raise ConfigError(path, "", f"cannot be read: {error.strerror}") from None
    if not stat.S_ISREG(mode):
        raise ConfigError(path, "", "is not a file")
    if mode & 0o077:
        raise ConfigError(path, "", f"others may read it (mode {mode & 0o777:03o}); chmod 600 it")
