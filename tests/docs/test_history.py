"""deploy/history: Telegraf reads the published topics, and the dashboard queries what Telegraf writes."""

import json
import re
from datetime import datetime
from pathlib import Path
from typing import Any

import pytest
import yaml
from fake_command_handler import FakeCommandHandler
from published_messages import TOPICS, messages
from telegraf_paths import Point, inputs, matches, points

from servo_ctrl.telemetry.mqtt import payloads

HISTORY = Path(__file__).parents[2] / "deploy" / "history"


@pytest.fixture(scope="module")
def written() -> list[Point]:
    return [point for topic, payload in messages().items() for point in points(topic, payload)]


def of(written: list[Point], measurement: str) -> Point:
    return next(point for point in written if point.measurement == measurement)


def configured(section: dict[str, Any]) -> set[str]:
    return {
        name
        for query in section.get("xpath", ())
        for name in (*query["fields"], *query.get("fields_int", {}))
    }


def test_every_path_finds_something_in_a_real_message(written: list[Point]) -> None:
    names = {name for section in inputs() for name in configured(section)} | {"value"}
    found = {name for point in written for name, field in point.fields.items() if field != ""}
    assert found == names


def test_every_input_has_a_topic_that_is_published() -> None:
    for section in inputs():
        (pattern,) = section["topics"]
        assert [topic for topic in messages() if matches(pattern, topic)], pattern


def test_published_values_arrive_unchanged(written: list[Point]) -> None:
    state = json.loads(messages()[TOPICS.state])
    machine, x = of(written, "servo_state"), of(written, "servo_axis")
    assert machine.tags == {"machine": "xy_table"}
    assert machine.fields["stage"] == state["stage"]
    assert machine.fields["required_um"] == 4.0
    assert machine.fields["progress"] == 0.25
    assert x.tags == {"machine": "xy_table", "axis": "x"}
    assert (x.fields["version"], x.fields["screw"], x.fields["observer"]) == (3.0, 1, 0)
    assert x.fields["error_mean_um"] == 2.4
    reversal = of(written, "servo_reversal")
    assert reversal.tags == {"machine": "xy_table", "axis": "x"}
    assert reversal.fields["contour_peak_um"] == 6.3
    assert of(written, "servo_online").fields == {"value": "online"}


def test_the_time_of_a_point_is_that_of_the_message(written: list[Point]) -> None:
    timed = [point for point in written if point.measurement != "servo_online"]
    assert all(datetime.fromisoformat(point.time).tzinfo is not None for point in timed)
    layouts = {query["timestamp_format"] for section in inputs() for query in section.get("xpath", ())}
    assert layouts == {"2006-01-02T15:04:05Z07:00"}  # Go's name of RFC 3339


def test_a_field_has_one_type_whatever_the_message() -> None:
    # InfluxDB refuses a field that has another type than before
    idle = points(TOPICS.state, payloads.state_payload(FakeCommandHandler().status(), 0))
    busy = points(TOPICS.state, messages()[TOPICS.state])
    for before, after in zip(idle, busy, strict=True):
        shared = before.fields.keys() & after.fields.keys()
        assert {name: type(before.fields[name]) for name in shared} == {
            name: type(after.fields[name]) for name in shared
        }


DASHBOARD = json.loads((HISTORY / "grafana" / "dashboards" / "servo.json").read_text(encoding="utf-8"))
QUERIES = [target["query"] for panel in DASHBOARD["panels"] for target in panel["targets"]]
VARIABLE = DASHBOARD["templating"]["list"][0]["query"]


def missing(query: str, written: list[Point]) -> list[str]:
    """Names of a query that nobody writes."""
    (measurement,) = re.findall(r'FROM "(\w+)"', query)
    there = [point for point in written if point.measurement == measurement]
    known = {name for point in there for name in (*point.fields, *point.tags)}
    return [name for name in re.findall(r'"(\w+)"', query) if name not in {measurement, *known}]


@pytest.mark.parametrize("query", [*QUERIES, VARIABLE])
def test_a_query_names_only_what_is_written(query: str, written: list[Point]) -> None:
    assert missing(query, written) == []


def test_a_wrong_name_is_detected(written: list[Point]) -> None:
    assert missing('SELECT max("error_mean_mm") FROM "servo_reversal" WHERE x', written) == ["error_mean_mm"]
    assert missing('SELECT max("cycle") FROM "servo_reversals" GROUP BY "axis"', written) == ["cycle", "axis"]


def test_grafana_is_given_the_source_that_the_dashboard_asks() -> None:
    provisioned = yaml.safe_load((HISTORY / "grafana/provisioning/datasources/servo.yaml").read_text())
    (source,) = provisioned["datasources"]
    asked = {panel["datasource"]["uid"] for panel in DASHBOARD["panels"]}
    asked |= {target["datasource"]["uid"] for panel in DASHBOARD["panels"] for target in panel["targets"]}
    assert asked == {source["uid"]}
    assert source["secureJsonData"] == {"httpHeaderValue1": "Token $INFLUX_TOKEN"}
    provider = yaml.safe_load((HISTORY / "grafana/provisioning/dashboards/servo.yaml").read_text())
    compose = yaml.safe_load((HISTORY.parents[1] / "docker-compose.yml").read_text())
    mounted = dict(volume.split(":")[:2] for volume in compose["services"]["grafana"]["volumes"])
    assert mounted["./deploy/history/grafana/dashboards"] == provider["providers"][0]["options"]["path"]
    environment = compose["services"]["influxdb"]["environment"]
    assert environment["DOCKER_INFLUXDB_INIT_BUCKET"] == source["jsonData"]["dbName"]


def test_panels_do_not_overlap_and_have_titles() -> None:
    taken: set[tuple[int, int]] = set()
    for panel in DASHBOARD["panels"]:
        place = panel["gridPos"]
        cells = {
            (x, y)
            for x in range(place["x"], place["x"] + place["w"])
            for y in range(place["y"], place["y"] + place["h"])
        }
        assert panel["title"]
        assert place["x"] + place["w"] <= 24
        assert not taken & cells
        taken |= cells
    assert len({panel["id"] for panel in DASHBOARD["panels"]}) == len(DASHBOARD["panels"])
