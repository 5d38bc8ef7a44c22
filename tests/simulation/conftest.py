"""What the tests of the world share."""

import numpy as np
import pytest

from fireworld.city.record import city_record
from tests.simulation.town import small_tanks, town


@pytest.fixture(scope="session")
def town_record():
    """The town as it is recorded, without people."""
    nobody = np.zeros(0, dtype=np.int32)
    return city_record(
        town(),
        civilian_mm=np.zeros((0, 2), dtype=np.int32),
        civilian_building=nobody,
        civilian_hp=nobody,
        n_brigades=3,
        brigades=small_tanks().brigades,
    )
