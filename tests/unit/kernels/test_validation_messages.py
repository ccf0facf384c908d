"""What is wrong with a value is said without the words of a schema."""

import pytest
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from kernels.validation_messages import plain_message


class Inner(BaseModel):
    at: float


class Declared(BaseModel):
    model_config = ConfigDict(extra="forbid")

    size: int = Field(gt=0)
    on: bool = False
    name: str = ""
    inner: Inner | None = None
    three: list[float] = Field(default_factory=list, max_length=3)


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"size": 0}, "must be greater than 0"),
        ({"size": "x"}, "must be an integer, unable to parse string as an integer"),
        ({"size": 1, "on": 2}, "must be true or false"),
        ({"size": 1, "name": 1}, "must be a text"),
        ({"size": 1, "inner": 1}, "must be a table"),
        ({"size": 1, "three": [1, 2, 3, 4]}, "list must have at most 3 items, not 4"),
        ({"size": 1, "width": 1}, "unknown key"),
        ({}, "is missing"),
    ],
)
def test_a_message_has_no_words_of_a_schema(values: dict[str, object], said: str) -> None:
    with pytest.raises(ValidationError) as refused:
        Declared.model_validate(values)
    assert plain_message(refused.value.errors()[0]["msg"]) == said
