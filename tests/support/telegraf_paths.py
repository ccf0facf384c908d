"""What Telegraf makes of a message by deploy/history/telegraf.conf: the XPath of that file, and no more.

The paths are `/a/b` from the root and `a/b` from the selected node, in `number()`, `string()`, compared with
a text, or a text alone; `name()` is the key of the selected node. Anything else is refused.
"""

import json
import math
import re
import tomllib
from pathlib import Path
from typing import Any, NamedTuple

CONFIGURATION = Path(__file__).parents[2] / "deploy" / "history" / "telegraf.conf"
_PATH = r"/?[a-z0-9_]+(?:/[a-z0-9_]+)*"
_FORMS = re.compile(
    rf"(?P<function>number|string)\((?P<path>{_PATH})\)(?: = '(?P<equals>[a-z]+)')?"
    rf"|string\('(?P<text>[a-z_]+)'\)|(?P<name>name\(\))|(?P<bare>{_PATH})"
)


class Point(NamedTuple):
    """A point as InfluxDB gets it."""

    measurement: str
    tags: dict[str, str]
    fields: dict[str, Any]
    time: str


def inputs() -> list[dict[str, Any]]:
    """The sections [[inputs.mqtt_consumer]]."""
    found = tomllib.loads(CONFIGURATION.read_text(encoding="utf-8"))["inputs"]["mqtt_consumer"]
    assert isinstance(found, list)
    return found


def matches(pattern: str, topic: str) -> bool:
    """Whether a subscription with `+` gets a topic."""
    levels, wanted = topic.split("/"), pattern.split("/")
    return len(levels) == len(wanted) and all(a in {"+", b} for a, b in zip(wanted, levels, strict=True))


def points(topic: str, payload: bytes) -> list[Point]:
    """Of all inputs that subscribe to the topic."""
    found = []
    for section in inputs():
        if not any(matches(pattern, topic) for pattern in section["topics"]):
            continue
        tags = _topic_tags(section, topic)
        if section["data_format"] == "value":
            found.append(Point(section["name_override"], tags, {"value": payload.decode()}, ""))
            continue
        assert section["data_format"] == "xpath_json"
        document = json.loads(payload)
        for query in section["xpath"]:
            found += [_point(query, document, key, node, tags) for key, node in _selected(query, document)]
    return found


def _topic_tags(section: dict[str, Any], topic: str) -> dict[str, str]:
    (parsing,) = section["topic_parsing"]
    assert matches(parsing["topic"], topic)
    names = parsing["tags"].split("/")
    return {name: level for name, level in zip(names, topic.split("/"), strict=True) if name != "_"}


def _selected(query: dict[str, Any], document: Any) -> list[tuple[str, Any]]:
    selection = query.get("metric_selection")
    if selection is None:
        return [("", document)]
    assert selection.endswith("/*"), selection
    return list(_at(selection.removesuffix("/*"), document, document).items())


def _point(query: dict[str, Any], document: Any, key: str, node: Any, tags: dict[str, str]) -> Point:
    def value(expression: str) -> Any:
        return evaluated(expression, document, key, node)

    fields = {name: value(expression) for name, expression in query["fields"].items()}
    fields |= {name: int(value(expression)) for name, expression in query.get("fields_int", {}).items()}
    own_tags = {name: value(expression) for name, expression in query.get("tags", {}).items()}
    there = {
        name: field for name, field in fields.items() if not isinstance(field, float) or math.isfinite(field)
    }
    return Point(value(query["metric_name"]), tags | own_tags, there, value(query["timestamp"]))


def evaluated(expression: str, document: Any, key: str, node: Any) -> Any:
    """An expression of the configuration. What is not there is NaN or an empty text, as in XPath."""
    form = _FORMS.fullmatch(expression)
    assert form is not None, f"{expression}: no form that is known here"
    if form["text"]:
        return form["text"]
    if form["name"]:
        return key
    found = _at(form["path"] or form["bare"], document, node)
    if form["function"] == "number":
        return math.nan if found is None else float(found)
    text = "" if found is None else str(found).lower() if isinstance(found, bool) else str(found)
    return text == form["equals"] if form["equals"] else text


def _at(path: str, document: Any, node: Any) -> Any:
    found = document if path.startswith("/") else node
    for level in path.strip("/").split("/"):
        if not isinstance(found, dict):
            return None
        found = found.get(level)
    return found
