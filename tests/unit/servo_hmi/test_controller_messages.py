"""Messages of the controller as the page shows them, in its language and with their arguments."""

import pytest

from servo_ctrl.hmi.languages.controller_messages import controller_text
from servo_ctrl.hmi.languages.texts import ENGLISH, CurrentLanguage


@pytest.mark.parametrize(
    ("english", "german"),
    [
        (
            "axis x: following error of 1.203 mm exceeds 1 mm; short circuit",
            "Achse x: Schleppfehler von 1.203 mm übersteigt 1 mm; Kurzschluss",
        ),
        (
            "axis.x.drive (node 1): no heartbeat in 300 cycles",
            "axis.x.drive (Knoten 1): kein Heartbeat in 300 Takten",
        ),
        ("the machine is quick stopping, not ready", "die Maschine ist im Schnellhalt, nicht bereit"),
        (
            "axis y: J 7.6 um -> 2.1 um, 12 strokes, version 3 in use",
            "Achse y: J 7.6 µm -> 2.1 µm, 12 Hübe, Version 3 in Gebrauch",
        ),
        (
            "axis z: the drive did not finish homing in 60 s",
            "Achse z: der Antrieb hat die Referenzfahrt in 60 s nicht beendet",
        ),
        ("anna: enable", "anna: enable"),
        ("x; " * 600, "x; " * 600),
    ],
)
def test_a_message_is_shown_in_german_with_its_arguments(
    monkeypatch: pytest.MonkeyPatch, english: str, german: str
) -> None:
    monkeypatch.setattr(CurrentLanguage, "find", staticmethod(lambda: "de"))
    assert controller_text(english) == german
    assert controller_text(english, ENGLISH) == english.replace(" um", " \N{MICRO SIGN}m")
