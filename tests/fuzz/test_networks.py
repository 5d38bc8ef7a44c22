"""Files of networks, altered or made up: only complaints come out, or a network that gives a number."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fireworld.kernels.network import value_by_network, widest
from fireworld.kernels.situation import N_SEEN
from fireworld.policy.teams.team import FORMAT, Team, parse_team
from tests.fuzz.support import FUZZ, altered, changed, only_complaints, target
from tests.fuzz.test_files import as_json, dtypes, npz
from tests.networks import make_network

pytestmark = pytest.mark.slow

TEAM = make_network(2, 3, 1, features=["mine", "volume"])
HEADER = {"format": FORMAT, "kind": "network", "provenance": {}, **TEAM.header()}


def use(team: Team) -> None:
    """Let a network value a target."""
    assert len(team.digest) == len(team.policy().digest) == 64
    assert list(team.describe())
    network = team.policy().network
    value = value_by_network(network, np.full(N_SEEN, 3.0), np.zeros((2, widest(network))))
    assert math.isfinite(value)


def use_file(data: bytes) -> None:
    with only_complaints():
        use(parse_team(data, source="team.npz"))


@target
@FUZZ
@given(altered(TEAM.to_bytes()))
def test_network_bytes(data):
    use_file(data)


sizes = st.sampled_from([0, 1, 2, 3, 1024, 1025])
numbers = st.sampled_from([0.0, -1.0, 1e9, -1e9, 1e10, 1e300, math.inf, math.nan])
arrays = st.tuples(dtypes, st.lists(sizes, max_size=3).filter(lambda shape: math.prod(shape) < 2**21), numbers)


@target
@FUZZ
@given(changed(HEADER), st.dictionaries(st.sampled_from(sorted(TEAM.arrays())), arrays, max_size=3))
def test_network_values(header, others):
    made = {}
    for name, (dtype, shape, number) in others.items():
        with np.errstate(all="ignore"):
            plain = np.full(shape, number if dtype.endswith(("f8", "f4", "c16")) else 1)
            made[name] = plain.astype(dtype) if dtype != "O" else plain.astype(object)
    use_file(npz({"header": np.frombuffer(as_json(header), np.uint8), **TEAM.arrays(), **made}))


@target
@FUZZ
@given(st.lists(st.sampled_from([1, 2, 40, 300]), max_size=9), st.sampled_from(["relu", "tanh"]), numbers)
def test_network_shapes(widths, activation, number):
    layers = zip([2, *widths], [*widths, 1], strict=True)
    held = {}
    for k, (n_in, n_out) in enumerate(layers):
        held |= {f"weights_{k}": np.full((n_in, n_out), number), f"biases_{k}": np.full(n_out, number)}
    header = {**HEADER, "activations": [activation] * len(widths)}
    use_file(npz({"header": np.frombuffer(as_json(header), np.uint8), **held}))


def test_the_good_file_is_read():
    use(parse_team(TEAM.to_bytes(), source="team.npz"))
