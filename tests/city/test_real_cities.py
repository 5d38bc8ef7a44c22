"""The city of Kobe against what the official program made of it: every table, every code."""

from __future__ import annotations

import pytest

from fireworld.city.formats.json_text import plan_text
from fireworld.conformance.check import check
from fireworld.conformance.city_file import load_city_file
from tests.real_data import real_file


@pytest.mark.slow
@pytest.mark.parametrize("name", ["kobe", "kobe_dry"])
def test_kobe_is_what_the_official_program_says(name):
    city_file = load_city_file(real_file(f"traces/{name}.json"))
    report = check(city_file, real_file(f"traces/{name}.npz"))
    assert report.tables == ()
    assert report.first_difference is None
    assert report.passed
    assert report.tallies["fieryness"].n_compared == 222_740
    assert len([note for note in report.notes if "building 14220" in note]) == 1


def test_kobe_survives_being_written_and_read(tmp_path):
    plan = load_city_file(real_file("traces/kobe.json")).plan
    (tmp_path / "kobe.json").write_text(plan_text(plan))
    again = load_city_file(tmp_path / "kobe.json").plan
    for name, array in vars(plan.footprints).items():
        assert (array == getattr(again.footprints, name)).all(), name
    assert again.notes == plan.notes
