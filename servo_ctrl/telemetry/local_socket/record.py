"""Converts a request from the page to a line of the command log and to an event text."""

import hashlib
from datetime import UTC, datetime
from typing import Any

from pydantic import ValidationError

from kernels.validation_messages import plain_message
from servo_ctrl.commands.local_messages import LocalRequest

LOGGED_CHARACTERS_MAX = 200
"""Bounds the characters of a value or reason in the log."""


def record_of(request: LocalRequest, cycle: int) -> dict[str, Any]:
    """Return a line of the log: the whole request, of a program only name, length and digest."""
    content = request.model_dump(mode="json", exclude_defaults=True, exclude={"program", "who", "id"})
    if request.program is not None:
        text = request.program.text.encode()
        digest = hashlib.sha256(text).hexdigest()
        content["program"] = {"name": request.program.name, "bytes": len(text), "sha256": digest}
        if request.program.first_line > 1:
            content["program"]["first_line"] = request.program.first_line
    if isinstance(request.value, str):
        content["value"] = request.value[:LOGGED_CHARACTERS_MAX]
    moment = datetime.now(UTC).isoformat(timespec="milliseconds")
    return {"time": moment, "cycle": cycle, **request.who.model_dump(), **content}


def in_words(request: LocalRequest) -> str:
    """Return sender and request as one printable line."""
    who = request.who
    match request.do:
        case "command":
            what = f"{request.command} {request.axis}".strip()
        case "setting":
            what = f"{request.setting} = {request.value}"
        case "jog":
            motion = f"at {request.value:g} m/s" if request.value else "ends"
            what = f"jog {request.axis} {motion}"
        case "jog_step":
            what = f"step {request.axis} by {_mm(request.value)}"
        case "touch_off":
            what = f"touch off {request.axis or 'all axes'}: here is {_mm(request.value)}"
        case "run_line":
            what = f"run {str(request.value)[:LOGGED_CHARACTERS_MAX]}"
        case "load_program":
            what = f"load {request.program.name}" if request.program is not None else "load"
            if request.program is not None and request.program.first_line > 1:
                what += f" from line {request.program.first_line}"
        case "write_object":
            what = f"write {request.index or 0:04X}h:{request.subindex or 0:02X} of node {request.node}"
        case _:
            axis = request.tuning.axis if request.tuning is not None else ""
            what = f"{request.do.replace('_', ' ')} {axis}".rstrip()
    text = f"{who.user} ({who.role}, {who.address}): {what}"
    return "".join(letter if letter.isprintable() else "?" for letter in text)


def _mm(value: object) -> str:
    return f"{1e3 * value:g} mm" if isinstance(value, int | float) else "?"


def reason_of(error: ValidationError) -> str:
    """Return the reason of pydantic's first error: the key and the fault."""
    first = error.errors(include_url=False, include_context=False, include_input=False)[0]
    place = ".".join(str(part) for part in first["loc"])
    text = plain_message(first["msg"])
    return f"{place}: {text}" if place else text
