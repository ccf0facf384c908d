"""JSON files that another program wrote, read with a bound and checked before a page shows them."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from kernels.validation_messages import plain_message
from servo_ctrl.errors import ServoCtrlError, reason_of

Content = TypeVar("Content", bound=BaseModel)


def read_json_file(
    kind: type[Content],
    path: Path,
    max_characters: int,
    failed: type[ServoCtrlError],
    parsed: Callable[[str], Any] = json.loads,
) -> Content:
    """Read a file as `kind`; `parsed` turns its text into plain values.

    Raises `failed`, naming file and key.
    """
    try:
        with path.open(encoding="utf-8") as file:
            text = file.read(max_characters + 1)
        if len(text) > max_characters:
            raise failed(f"{path}: has more than {max_characters} characters")
        return kind.model_validate(parsed(text))
    except OSError as error:
        raise failed(f"{path}: cannot be read: {reason_of(error)}") from None
    except ValidationError as error:
        first = error.errors()[0]
        key = ".".join(map(str, first["loc"]))
        raise failed(f"{path}: {key}: {plain_message(first['msg'])}") from None
    except (ValueError, RecursionError) as error:
        raise failed(f"{path}: is not JSON: {error}") from None
