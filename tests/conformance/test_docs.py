"""docs/traces.md names every key and array that conformance reads."""

from pathlib import Path

import pytest

from fireworld.city.formats.json_plan import BUILDING_KEYS, IGNORED_KEYS, READ_KEYS
from fireworld.city.formats.official.keys import BRIGADE_KEYS, BURN_KEYS, FIRE_KEYS, RAY_KEYS
from fireworld.conformance.derived import DERIVED
from fireworld.conformance.trace import INPUTS, LABELS, OUTPUTS

PAGE = (Path(__file__).parents[2] / "docs" / "traces.md").read_text(encoding="utf-8")
ARRAYS = {*INPUTS, *OUTPUTS, *LABELS, *DERIVED}
KEYS = {*BUILDING_KEYS, *READ_KEYS, *IGNORED_KEYS, *FIRE_KEYS, *BURN_KEYS, *RAY_KEYS, *BRIGADE_KEYS}


@pytest.mark.parametrize("name", sorted(ARRAYS | KEYS))
def test_page_names(name):
    assert any(f"`{name}`" in line for line in PAGE.splitlines() if line.startswith("| `"))
