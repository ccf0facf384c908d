"""Presliding of two springs that slip (10 and 7 N/um): found alone, to the noise, written without a loss."""

import pytest
from concealed_effects import twin_recording
from concealed_machine import motion, write_machine

from reconcile.catalogue.kinds import ResidualChannel
from reconcile.diagnosis.diagnose import WrittenDiagnosis, diagnose
from reconcile.identification.explain import Explanation
from reconcile.nominal_model.model_file import load_model
from reconcile.regression.residual import rms
from reconcile.regression.residual_noise import noise_floor

COULOMB_N, MASS_KG = 40.0, 70.0
STIFFNESS_N_M = 17e6
CONTACT = """[axis.NAME.presliding_gms]
share = [0.59, 0.41]
stiffness_n_um = [10.0, 7.0]
attraction_n_s = 5000.0
micro_damping_n_s_m = 0.0
"""
MOST_FLOORS = 1.5


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> tuple[WrittenDiagnosis, WrittenDiagnosis]:
    """A diagnosis from the machine without the contact, and one from what it has written."""
    folder = tmp_path_factory.mktemp("contact")
    nominal = write_machine(folder / "nominal", {"x": ""}, motion()[:, None])
    machine = write_machine(folder / "machine", {"x": CONTACT}, motion()[:, None])
    for file in (nominal / "plant.toml", machine / "plant.toml"):
        file.write_text(file.read_text().replace("coulomb_n = 10.0", f"coulomb_n = {COULOMB_N}"))
    recording = twin_recording(machine, machine / "plant.toml", folder / "run.parquet")
    options = {"with_report": False, "with_next": False}
    first = diagnose([recording], nominal / "plant.toml", folder / "first", **options)
    return first, diagnose([recording], first.model_file, folder / "second", **options)


def force(of: WrittenDiagnosis) -> Explanation:
    return next(e for e in of.explanations["x"] if e.channel is ResidualChannel.FORCE)


def test_the_contact_is_named_alone_with_its_distance(
    found: tuple[WrittenDiagnosis, WrittenDiagnosis],
) -> None:
    explanation = force(found[0])
    assert [f.effect for f in [*explanation.findings, *explanation.minor]] == ["presliding_hysteresis"]
    [finding] = explanation.findings
    slipped_m = 0.632 * COULOMB_N / STIFFNESS_N_M  # 63 % of where the springs slip
    shapes = [c.shape_parameters for c in finding.candidates]  # one, or two that are nearly alike
    assert all(exponent == 0.0 for _, exponent in shapes)
    assert [way_m for way_m, _ in shapes] == pytest.approx([slipped_m] * len(shapes), rel=0.05)
    levels_n = [of.value for key, of in finding.parameters.items() if key.startswith("level_n")]
    assert sum(levels_n) == pytest.approx(COULOMB_N, rel=0.05)


def test_what_it_leaves_is_the_noise(found: tuple[WrittenDiagnosis, WrittenDiagnosis]) -> None:
    residuals = force(found[0]).residuals
    floor = noise_floor(residuals, ResidualChannel.FORCE, MASS_KG).rms
    assert rms(residuals, "after") <= MOST_FLOORS * floor
    assert rms(residuals, "refitted") > 20.0 * floor  # else any model would do


def test_the_written_model_takes_it_off_again(found: tuple[WrittenDiagnosis, WrittenDiagnosis]) -> None:
    first, second = found
    effects = load_model(first.model_file).axes["x"].model_effects.effects
    assert set(effects) == {"presliding_elements"}
    assert force(second).findings == []
    assert force(second).before.train == pytest.approx(force(first).after.train, rel=0.2)
