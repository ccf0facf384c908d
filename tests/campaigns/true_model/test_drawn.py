"""The campaign of true models draws plants within its bounds and covers every program."""

import tomllib

from machine_files import XY_TABLE

from tests.campaigns.true_model.main import SHARES, Case, cases, drawn


def test_random_plants_differ_within_their_bounds_in_masses_and_friction_only() -> None:
    text = (XY_TABLE / "plant.toml").read_text(encoding="utf-8")
    before, after = tomllib.loads(text), tomllib.loads(drawn(text, 1))
    ratios = {}
    for axis, sections in before["axis"].items():
        for section, values in sections.items():
            for key, value in values.items():
                other = after["axis"][axis][section][key]
                if other != value:
                    ratios[axis, section, key] = other / value
    assert {key for _axis, _section, key in ratios} == set(SHARES)
    assert all(abs(ratio - 1.0) <= SHARES[key] for (_axis, _section, key), ratio in ratios.items())
    assert len(set(ratios.values())) == len(ratios)
    assert drawn(text, 1) == drawn(text, 1) != drawn(text, 2)


def test_every_program_of_the_repository_is_run_as_it_is_and_on_each_random_plant() -> None:
    planned = list(cases(7, 2))
    for program in (XY_TABLE / "programs").iterdir():
        assert [case for case in planned if case[:2] == ("xy_table", program.name)] == [
            Case("xy_table", program.name, seed) for seed in (0, 7, 8)
        ]
