"""Messages of the controller as the page shows them, in its language and with their arguments."""

import pytest

from servo_ctrl.hmi.languages.controller_messages import controller_text, diagnosis_text
from servo_ctrl.hmi.languages.report_page import note_text
from servo_ctrl.hmi.languages.texts import ENGLISH, CurrentLanguage

ACCEPTED_ON_MASSES = (
    "contour_control: kp_1_s was accepted on the measured plant of y and the mass of x; the margin lacks "
    "resonances and delay of x: servo-ctrl tune --axis NAME --apply measures them"
)
ACCEPTED_ON_MASSES_IN_GERMAN = (
    "contour_control: kp_1_s wurde angenommen auf der gemessenen Strecke von y und der Masse von x; "
    "in der Reserve fehlen Resonanzen und Totzeit von x: servo-ctrl tune --axis NAME --apply misst sie"
)


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
        (
            "the controller has made no run: the run is over; nothing was changed",
            "die Steuerung hat die Fahrt nicht gemacht: der Lauf ist zu Ende; nichts wurde geändert",
        ),
        (ACCEPTED_ON_MASSES, ACCEPTED_ON_MASSES_IN_GERMAN),
        ("anna: enable", "anna: enable"),
        ("x; " * 600, "x; " * 600),
        ("x: " * 600, "x: " * 600),
    ],
)
def test_a_message_is_shown_in_german_with_its_arguments(
    monkeypatch: pytest.MonkeyPatch, english: str, german: str
) -> None:
    monkeypatch.setattr(CurrentLanguage, "find", staticmethod(lambda: "de"))
    assert controller_text(english) == german
    assert controller_text(english, ENGLISH) == english.replace(" um", " \N{MICRO SIGN}m")


@pytest.mark.parametrize(
    ("english", "german"),
    [
        (
            'part.toml: step[2] "a".radius_mm: must be greater than 0 (got -2.0) (and 1 more)',
            'part.toml: step[2] "a".radius_mm: der Wert muss größer sein als 0 (ist -2.0) (und 1 weitere)',
        ),
        (
            "line 3: axis x: position 4 mm is beyond the limit 1 mm, 2 s into lines 3-6",
            "Zeile 3: Achse x: Position 4 mm überschreitet die Grenze 1 mm, 2 s nach Beginn: Zeilen 3-6",
        ),
        (
            "part.ngc: line 7: G81: there are no canned cycles; write the moves out",
            "part.ngc: Zeile 7: G81: Bearbeitungszyklen gibt es nicht; die Bewegungen ausschreiben",
        ),
        (
            "part.toml: not valid TOML: Expected '=' after a key in a key/value pair (at line 1, column 5)",
            "part.toml: kein gültiges TOML: nach einem Schlüssel fehlt „=“ (Zeile 1, Spalte 5)",
        ),
        (
            "part.toml: step[1].profile: 'x' is not one of 's_curve', 'trapezoidal'",
            "part.toml: step[1].profile: 'x' ist keines von 's_curve', 'trapezoidal'",
        ),
        (
            "part.toml: cannot be read: [Errno 13] Permission denied: 'part.toml'",
            "part.toml: kann nicht gelesen werden: [Errno 13] keine Berechtigung: 'part.toml'",
        ),
    ],
)
def test_what_a_loader_says_of_a_file_is_shown_in_german(
    monkeypatch: pytest.MonkeyPatch, english: str, german: str
) -> None:
    monkeypatch.setattr(CurrentLanguage, "find", staticmethod(lambda: "de"))
    assert controller_text(english) == german


FRICTION = (
    "friction falls by 3.10 N below 4.2 mm/s, in both directions alike and at constant speed too: Stribeck "
    "friction; presliding would show over the way, not the speed"
)
REIBUNG = (
    "die Reibung fällt um 3.10 N unter 4.2 mm/s, in beiden Richtungen gleich und auch bei gleichförmiger "
    "Fahrt: Stribeck-Reibung; Vorgleiten würde sich über dem Weg zeigen, nicht über der Geschwindigkeit"
)


@pytest.mark.parametrize(
    ("english", "german"),
    [
        ("drive compliance", "Nachgiebigkeit des Antriebsstrangs"),
        ("axis x: scale less motor", "Achse x: Maßstab minus Motor"),
        (FRICTION, REIBUNG),
        (
            f"something real that no entry of the catalogue explains: in recording 2: {FRICTION}",
            f"etwas Wirkliches, das kein Eintrag des Katalogs erklärt: in Aufzeichnung 2: {REIBUNG}",
        ),
    ],
)
def test_what_a_diagnosis_says_is_shown_in_german(
    monkeypatch: pytest.MonkeyPatch, english: str, german: str
) -> None:
    monkeypatch.setattr(CurrentLanguage, "find", staticmethod(lambda: "de"))
    assert diagnosis_text(english) == german


def test_a_note_on_the_model_is_shown_in_german(monkeypatch: pytest.MonkeyPatch) -> None:
    """Keys of the model file stay as they are."""
    monkeypatch.setattr(CurrentLanguage, "find", staticmethod(lambda: "de"))
    english = "model.toml, axis x: unknown is not in the model: it is in no catalogue, so no plant has it"
    german = (
        "model.toml, Achse x: unbekannt ist nicht im Modell: es steht in keinem Katalog, also hat es "
        "keine Strecke"
    )
    assert note_text(english) == german
    monkeypatch.setattr(CurrentLanguage, "find", staticmethod(lambda: ENGLISH))
    assert note_text("model.toml, axis x: as found") == "model.toml, axis x: as found"
