"""Seeded mutation of bytes, for the short run of the fuzz targets, which needs no atheris."""

import random
from collections.abc import Sequence

NUMBERS = (b"0", b"-1", b"1e309", b"nan", b"inf", b"9" * 5000, b"-0.0", b"2147483648", b"0x", b"true")
TEXTS = (
    b"\0",
    b"\xff\xfe",
    b"\xed\xa0\x80",
    "ü😀".encode(),
    b"[" * 3000,
    b"{" * 3000,
    b"$NODEID",
    b'"""',
    b"\r\n",
)
LARGEST = 1 << 18


def mutated(data: bytes, rng: random.Random, words: Sequence[bytes], others: Sequence[bytes]) -> bytes:
    """Return `data` after one to eight random changes, some with `words` or pieces of `others`."""
    for _ in range(1 << rng.randrange(4)):
        data = _once(data, rng, words, others)
    return data[:LARGEST]


def _once(  # noqa: PLR0911  # one return a kind of change
    data: bytes, rng: random.Random, words: Sequence[bytes], others: Sequence[bytes]
) -> bytes:
    at, end = sorted((rng.randrange(len(data) + 1), rng.randrange(len(data) + 1)))
    match rng.randrange(9):
        case 0 if data:
            place = min(at, len(data) - 1)
            return data[:place] + bytes((data[place] ^ 1 << rng.randrange(8),)) + data[place + 1 :]
        case 1 if data:
            place = min(at, len(data) - 1)
            return data[:place] + rng.randbytes(1) + data[place + 1 :]
        case 2:
            return data[:at] + rng.randbytes(rng.randrange(1, 9)) + data[at:]
        case 3:
            return data[:at] + data[min(end, at + rng.randrange(1, 64)) :]
        case 4:
            return data[:at] + data[at : at + 256] + data[at:]
        case 5:
            return data[:at]
        case 6:
            return data[:at] + rng.choice((*words, *NUMBERS, *TEXTS)) + data[at:]
        case 7:
            word = rng.choice((*words, *NUMBERS))
            return data[:at] + word + data[at + len(word) :]
        case _:
            other = rng.choice(others) if others else b""
            start = rng.randrange(len(other) + 1)
            return data[:at] + other[start : start + rng.randrange(1, 200)] + data[end:]
