"""The lines of a stroke journal: a header and strokes in JSON, chained by their checksums.

A line ends with the CRC-32 of its JSON, continued from the checksum of the previous line, so that a changed,
missing or exchanged line is detected.
"""

import zlib
from typing import Annotated, Literal, Self, TypeVar

import numpy as np
from pydantic import Field, Strict, ValidationError

from kernels.validation_messages import plain_message
from servo_ctrl.config.section import FileSection, NonNegative, Number, Positive
from servo_ctrl.learned.file_model import Scalar  # pydantic resolves the annotation
from servo_ctrl.learning.stroke_result import ERROR_RESOLUTION_M
from servo_ctrl.learning.types import Pulse, Stroke, StrokeResult

_CHECKSUM = b',"crc32":"%08x"}\n'
_CHECKSUM_LENGTH = len(_CHECKSUM % 0)

Nanometres = Annotated[int, Strict(), Field(ge=-(10**9), le=10**9)]
Trace = Annotated[list[Nanometres], Field(min_length=1)]


class Header(FileSection):
    """The first line: the settings and machine-file values that the strokes depend on."""

    format: Literal[1] = 1
    axis: str
    settings: dict[str, Scalar | list[Number]]
    basis: dict[str, Scalar]


class StrokeLine(FileSection):
    """A stroke and its errors."""

    stage: Annotated[str, Field(max_length=100)]
    acceleration_m_s2: Positive
    pulse: tuple[NonNegative, Number, NonNegative, NonNegative, Number]
    period_s: Positive
    error_nm: Annotated[list[Trace], Field(min_length=1)]
    rest_s: Positive | None = None
    """Absent where the stroke does not rest."""

    @classmethod
    def of(cls, stroke: Stroke, result: StrokeResult) -> Self:
        """Make a line. Raises ValueError if an error is not a whole nanometre or a value is invalid."""
        error_nm = np.rint(result.error_m / ERROR_RESOLUTION_M)
        if not (
            np.isfinite(error_nm).all() and np.array_equal(error_nm * ERROR_RESOLUTION_M, result.error_m)
        ):
            raise ValueError("the errors of a stroke must be finite whole nanometres")
        return cls(
            stage=stroke.stage,
            acceleration_m_s2=stroke.acceleration_m_s2,
            pulse=tuple(stroke.pulse),
            period_s=result.period_s,
            error_nm=error_nm.astype(np.int64).tolist(),
            rest_s=stroke.rest_s or None,
        )

    def entry(self) -> tuple[Stroke, StrokeResult]:
        """Return stroke and result, identical to the bit. Raises ValueError if traces differ in length."""
        error_m = np.array(self.error_nm, dtype=np.float64) * ERROR_RESOLUTION_M
        stroke = Stroke(self.stage, self.acceleration_m_s2, Pulse(*self.pulse), self.rest_s or 0.0)
        return stroke, StrokeResult(error_m, self.period_s)


Content = TypeVar("Content", Header, StrokeLine)


def encoded(content: FileSection, before: int) -> tuple[bytes, int]:
    """Return a line and its checksum; `before` is the checksum of the previous line, 0 for the first."""
    body = content.model_dump_json(exclude_none=True).encode()
    checksum = zlib.crc32(body, before)
    return body[:-1] + _CHECKSUM % checksum, checksum


def decoded(kind: type[Content], line: bytes, before: int) -> tuple[Content, int]:
    """Return the content of a line (without its end) and its checksum. Raises ValueError."""
    body = line[: 1 - _CHECKSUM_LENGTH] + b"}"
    checksum = zlib.crc32(body, before)
    if line + b"\n" != body[:-1] + _CHECKSUM % checksum:
        raise ValueError("is damaged: its checksum does not fit")
    try:
        return kind.model_validate_json(body), checksum
    except ValidationError as error:
        first = error.errors()[0]
        raise ValueError(
            f"was not written by this servo-ctrl: {first['loc']}: {plain_message(first['msg'])}"
        ) from None
