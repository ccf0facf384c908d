"""Points that Telegraf makes of a message by deploy/history/telegraf.conf: its XPath, evaluated by libxml2.

As in Telegraf a key of the JSON document is an element; `/a` begins at the document, `a` at the node.
"""

import json
import math
import re
import tomllib
from pathlib import Path
from typing import Any, NamedTuple

from lxml import etree

CONFIGURATION = Path(__file__).parents[2] / "deploy" / "history" / "telegraf.conf"
_ABSOLUTE = re.compile(r"(?<![\w/*.)])/(?=[a-z])")
"""The slash with which an absolute path begins."""


class Point(NamedTuple):
    """A point as InfluxDB receives it."""

    measurement: str
    tags: dict[str, str]
    fields: dict[str, Any]
    time: str


def inputs() -> list[dict[str, Any]]:
    """Return the sections [[inputs.mqtt_consumer]]."""
    found = tomllib.loads(CONFIGURATION.read_text(encoding="utf-8"))["inputs"]["mqtt_consumer"]
    assert isinstance(found, list)
    return found


def matches(pattern: str, topic: str) -> bool:
    """Return whether a subscription with `+` matches a topic."""
    levels, wanted = topic.split("/"), pattern.split("/")
    return len(levels) == len(wanted) and all(a in {"+", b} for a, b in zip(wanted, levels, strict=True))


def points(topic: str, payload: bytes) -> list[Point]:
    """Return the points of all inputs that subscribe to the topic."""
    found = []
    for section in inputs():
        if not any(matches(pattern, topic) for pattern in section["topics"]):
            continue
        tags = _topic_tags(section, topic)
        if section["data_format"] == "value":
            found.append(Point(section["name_override"], tags, {"value": payload.decode()}, ""))
            continue
        assert section["data_format"] == "xpath_json"
        document = element_of("document", json.loads(payload))
        for query in section["xpath"]:
            selected = (
                nodes(query["metric_selection"], document) if "metric_selection" in query else [document]
            )
            found += [_point(query, node, tags) for node in selected]
    return found


def _topic_tags(section: dict[str, Any], topic: str) -> dict[str, str]:
    (parsing,) = section["topic_parsing"]
    assert matches(parsing["topic"], topic)
    names = parsing["tags"].split("/")
    return {name: level for name, level in zip(names, topic.split("/"), strict=True) if name != "_"}


def _point(query: dict[str, Any], node: etree._Element, tags: dict[str, str]) -> Point:
    fields = {name: evaluated(expression, node) for name, expression in query["fields"].items()}
    fields |= {name: int(evaluated(text, node)) for name, text in query.get("fields_int", {}).items()}
    own_tags = {name: evaluated(expression, node) for name, expression in query.get("tags", {}).items()}
    there = {
        name: field for name, field in fields.items() if not isinstance(field, float) or math.isfinite(field)
    }
    return Point(
        evaluated(query["metric_name"], node), tags | own_tags, there, evaluated(query["timestamp"], node)
    )


def element_of(name: str, value: Any) -> etree._Element:
    """Return a JSON value as an element; null is an element without text."""
    element = etree.Element(name)
    if isinstance(value, dict):
        element.extend(element_of(key, inner) for key, inner in value.items())
    elif isinstance(value, list):
        element.extend(element_of("element", inner) for inner in value)
    elif value is not None:
        element.text = str(value).lower() if isinstance(value, bool) else str(value)
    return element


def nodes(expression: str, node: etree._Element) -> list[etree._Element]:
    """Return the nodes that an expression selects."""
    found = node.xpath(_ABSOLUTE.sub("/document/", expression))
    assert isinstance(found, list)
    return found


def evaluated(expression: str, node: etree._Element) -> Any:
    """Return a number, text or boolean; of nodes the text of the first. A missing value is NaN or empty."""
    found = node.xpath(_ABSOLUTE.sub("/document/", expression))
    return (found[0].text or "" if found else "") if isinstance(found, list) else found
