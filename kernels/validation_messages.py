"""Rewords pydantic's messages about a value for a person who writes a file."""

import re

_WORDS = (
    (re.compile(r"^Input should be "), "must be "),
    (re.compile(r"^Extra inputs are not permitted$"), "unknown key"),
    (re.compile(r"^Field required$"), "is missing"),
    (re.compile(r"\ba valid (dictionary|mapping)( or instance of \S+)?"), "a table"),
    (re.compile(r"\ba valid "), "a "),
    (re.compile(r"\ba boolean"), "true or false"),
    (re.compile(r"\ba string"), "a text"),
    (re.compile(r"\ba integer"), "an integer"),
    (re.compile(r" should have "), " must have "),
    (re.compile(r" should match "), " must match "),
    (re.compile(r" after validation|, unable to interpret input"), ""),
)


def plain_message(message: str) -> str:
    """Return pydantic's message about a value without words of its schema, with a small first letter."""
    for pattern, words in _WORDS:
        message = pattern.sub(words, message)
    return message[:1].lower() + message[1:]
