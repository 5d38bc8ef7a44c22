"""What the tests of the world share."""

import numpy as np
import pytest

from fireworld.simulation.observer import city_record
from fireworld.simulation.placement import Placement
from tests.simulation.town import small_tanks, town


@pytest.fixture(scope="session")
def town_record():
    """The town as it is recorded, without people."""
    nobody = np.zeros(0, dtype=np.int32)
    start = Placement(nobody, nobody, np.zeros((0, 2), dtype=np.int32), np.zeros(3, dtype=np.int32))
    return city_record(town(), start, small_tanks())
