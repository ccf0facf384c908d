"""20 000 hostile frames to daemon and simulator in simulated time cause no crash, hang or uncommanded motion.

The long version, with real processes at full rate, is `make hostile`; docs/hostile_bus.md.
"""

from pathlib import Path

import pytest

from tests.campaigns.campaign.machine import CampaignMachine, make_machine
from tests.campaigns.hostile.attack import Attack, run_attack
from tests.campaigns.hostile.frames import FAMILIES, HostileFrame
from tests.campaigns.hostile.plan import STATES, plan_attacks
from tests.campaigns.hostile.verdict import judge

FRAMES, EACH = 20_000, 1000


@pytest.fixture(scope="module")
def machine(tmp_path_factory: pytest.TempPathFactory) -> CampaignMachine:
    return make_machine(tmp_path_factory.mktemp("machine"))


@pytest.mark.parametrize(
    "attack", plan_attacks(8, FRAMES // EACH, EACH), ids=lambda one: f"{one.family}-{one.state}-{one.seed}"
)
def test_attacks_cause_no_crash_hang_or_motion(
    attack: Attack, machine: CampaignMachine, tmp_path: Path
) -> None:
    assert judge(run_attack(attack, machine, tmp_path)).problems == ()


def test_the_plan_has_every_family_and_every_state() -> None:
    attacks = plan_attacks(8, FRAMES // EACH, EACH)
    assert {attack.family for attack in attacks} == set(FAMILIES)
    assert {attack.state for attack in attacks} == set(STATES)
    assert sum(attack.frames for attack in attacks) == FRAMES


def test_a_controller_without_standby_is_not_attacked_in_standby() -> None:
    assert {a.state for a in plan_attacks(8, 300, EACH) if not a.stand_by} == set(STATES) - {"standby"}


def test_an_attack_is_the_same_each_time(machine: CampaignMachine, tmp_path: Path) -> None:
    attack = Attack(
        seed=5,
        family="mutated_traffic",
        state="running",
        pacing="realtime",
        stand_by=True,
        frames=300,
        only_harmless=False,
    )
    one, other = tmp_path / "one", tmp_path / "other"
    one.mkdir()
    other.mkdir()
    first, second = run_attack(attack, machine, one), run_attack(attack, machine, other)
    assert (first.truth.position_m == second.truth.position_m).all()
    assert (first.stages, first.answers, first.sent) == (second.stages, second.answers, second.sent)


def test_attacks_that_can_cannot_defend_against(machine: CampaignMachine, tmp_path: Path) -> None:
    """A station that forges set points moves a drive; the controller can only end and report why."""
    attack = Attack(
        seed=8,
        family="impostor_set_points",
        state="standby",
        pacing="realtime",
        stand_by=True,
        frames=1000,
        only_harmless=False,
    )
    outcome = run_attack(attack, machine, tmp_path)
    verdict = judge(outcome)
    assert verdict.problems == ()
    assert verdict.unpowered
    assert verdict.moved_mm > 0.1
    assert outcome.report is not None
    assert "another controller sends" in outcome.report.reason


def test_a_frame_converts_to_a_python_can_message() -> None:
    message = HostileFrame(0x123, bytes(3), remote=True).message()
    assert (message.is_remote_frame, message.dlc, bytes(message.data)) == (True, 3, b"")
