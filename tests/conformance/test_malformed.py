"""Malformed cities and traces: one line with file, key, what was expected and what was found; never a traceback."""

import io
import json
import zipfile

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fireworld.conformance.check import check
from fireworld.conformance.city_file import load_city_file
from fireworld.errors import CityError, FireworldError, TraceError
from tests.conformance.conftest import city_path, trace_arrays, trace_path

pytestmark = pytest.mark.slow

MINI = load_city_file(city_path("mini"))
ARRAYS = trace_arrays("mini")
N_DRAWS = len(ARRAYS["burn_rate_draws"])


def refusal_of(call):
    """Return the one line with which a call refuses its input, None if it takes it."""
    try:
        call()
    except FireworldError as error:
        assert "\n" not in str(error)  # noqa: PT017 - it need not raise
        return str(error)
    return None


def changed(name, index, value, dtype=None):
    array = ARRAYS[name].astype(dtype or ARRAYS[name].dtype)
    array[index] = value
    return {name: array}


def params(**changes):
    return {"params": np.array(json.dumps(json.loads(str(ARRAYS["params"])) | changes))}


NESTED = "[" * 100_000
WRONG = {
    "nothing there": ({"fieryness": None}, "fieryness: expected this array to be there, got a file without it"),
    "no parameters": ({"params": None}, "params: expected this array to be there"),
    "other n": ({"fieryness": np.zeros((5, 9), dtype=np.uint8)}, "a column for each of the 12 buildings of "),
    "three axes": ({"fieryness": np.zeros((5, 12, 1))}, "fieryness: expected shape (any, 12), got shape (5, 12, 1)"),
    "no axes": ({"fieryness": np.array(3)}, "fieryness: expected shape (any, 12), got shape ()"),
    "no rows": ({"fieryness": np.zeros((0, 12))}, "a row for the start"),
    "no such code": (changed("fieryness", (4, 2), 9), "fieryness[4][2]: expected a whole number from 0 to 8, got 9"),
    "NaN as a code": (changed("fieryness", (4, 2), np.nan, "f8"), "fieryness[4][2]: expected a whole number"),
    "text for codes": ({"fieryness": np.full((5, 12), "a")}, "fieryness: expected an array of numbers, got one of <U1"),
    "complex": ({"energy": ARRAYS["energy"] * 1j}, "energy: expected an array of numbers, got one of complex128"),
    "dates": ({"energy": ARRAYS["energy"].astype("M8[s]")}, "energy: expected an array of numbers"),
    "NaN": (changed("energy", (9, 1), np.nan), "energy[9][1]: expected a finite number, got nan"),
    "infinity": (changed("fuel", (9, 1), np.inf), "fuel[9][1]: expected a finite number, got inf"),
    "half a litre": (changed("water", (9, 1), 0.5, "f8"), "water[9][1]: expected a whole number"),
    "too much": (changed("water", (9, 1), 2**63, "u8"), "water[9][1]: expected a whole number"),
    "rows missing": ({"energy": ARRAYS["energy"][:50]}, "energy: expected 121 rows, got 50 rows"),
    "kept rows missing": (
        {"steps": np.arange(9)[1:], "energy": ARRAYS["energy"][:9]},
        "8 rows or 121 rows, got 9 rows",
    ),
    "steps beyond the end": ({"steps": np.array([0, 121])}, "steps[1]: expected a whole number from 0 to 120, got 121"),
    "falling steps": ({"steps": np.array([3, 2])}, "steps[1]: expected rising steps, got 2"),
    "steps without axis": ({"steps": np.array(3)}, "steps: expected shape (any), got shape ()"),
    "air of other steps": ({"air_t": np.arange(5)}, "air: expected shape (5, 9, 11), got shape (121, 9, 11)"),
    "air of another grid": ({"air": np.zeros((121, 3, 3))}, "air: expected shape (121, 9, 11)"),
    "air of an unknown grid": ({"air": np.zeros((121, 3, 3)), "grid_shape": None}, "air: expected (9, 11) cells"),
    "other ids": (changed("id", 4, 99), "id[4]: expected the city's building "),
    "an order too short": ({"order": np.arange(11)}, "order: expected shape (12), got shape (11)"),
    "an order with gaps": ({"order": np.zeros(12, int)}, "order[0]: expected every building once, got 0"),
    "an order of others": ({"order": np.arange(12) + 1}, "order[11]: expected a whole number from 0 to 11, got 12"),
    "links without ends": ({"conn_idx": None}, "conn_idx: expected this array to be there"),
    "pointers beyond": (changed("conn_ptr", 3, 999), "conn_ptr[3]: expected a whole number from 0 to 63, got 999"),
    "negative pointers": (changed("conn_ptr", 0, -1), "conn_ptr[0]: expected a whole number"),
    "falling pointers": (changed("conn_ptr", 3, 1), "conn_ptr[3]: expected rising numbers, got 1"),
    "pointers that stop": (changed("conn_ptr", 12, 60), "conn_ptr: expected 0 first and 63 last, got 0 and 60"),
    "links to nowhere": (changed("conn_idx", 5, 12), "conn_idx[5]: expected a whole number from 0 to 11, got 12"),
    "shares missing": ({"conn_val": ARRAYS["conn_val"][1:]}, "conn_val: expected shape (63), got shape (62)"),
    "negative shares": (changed("conn_val", 5, -0.5), "conn_val[5]: expected a share from 0 to 1, got -0.5"),
    "no rates": ({"burn_rate_draws": np.zeros(0)}, "burn_rate_draws: expected at least one rate"),
    "rates of others": ({"burn_rate_draws": np.zeros((11, 9))}, "burn_rate_draws: expected shape (12, any)"),
    "too few rates": (
        {"burn_rate_draws": np.full(3, 0.15)},
        "burn_rate_draws: expected a rate for every step in which",
    ),
    "rates that vary": (
        {"burn_rate_draws": None} | params(**{"resq-fire.burn-rate-variance": "0.02"}),
        "burn_rate_draws: expected this array to be there, because params say that burn rates vary",
    ),
    "a wall area of nothing": (changed("wall_area", 2, np.nan), "wall_area[2]: expected a finite number, got nan"),
    "a table of others": ({"volume": ARRAYS["volume"][:-1]}, "volume: expected shape (12), got shape (11)"),
    "half a table": ({"walls": ARRAYS["walls"][:, :4]}, "walls: expected shape (any, 6), got shape (48, 4)"),
    "numbers as parameters": ({"params": np.array(3)}, "params: expected a single text, got "),
    "many parameters": ({"params": np.array(["a", "b"])}, "params: expected a single text, got "),
    "no JSON": ({"params": np.array("{'a': 1}")}, "params: expected a JSON text"),
    "deep JSON": ({"params": np.array(NESTED)}, "params: expected a JSON text"),
    "a JSON list": ({"params": np.array("[1]")}, "params: expected a JSON object"),
    "a key missing": (params(**{"resq-fire.gamma": None}), "params: resq-fire.gamma: expected this key to be set"),
    "a word": (params(**{"resq-fire.gamma": "much"}), "params: resq-fire.gamma: expected a number, got 'much'"),
    "a list": (params(**{"resq-fire.gamma": [1]}), "params: resq-fire.gamma: expected a number, got [1]"),
    "a truth": (params(**{"resq-fire.gamma": True}), "params: resq-fire.gamma: expected a number, got True"),
    "not a number": (params(**{"resq-fire.gamma": "nan"}), "params: resq-fire.gamma: expected a number at least 0"),
    "a huge number": (params(**{"resq-fire.gamma": 10**400}), "params: resq-fire.gamma: expected a number"),
    "no capacity": (
        params(**{"resq-fire.wooden_capacity": "0"}),
        "resq-fire.wooden_capacity: expected a number above 0",
    ),
    "half a cell": (
        params(**{"resq-fire.cell_size": "5000.5"}),
        "resq-fire.cell_size: expected a whole number at least",
    ),
}


@pytest.mark.parametrize("case", WRONG)
def test_malformed_traces(write, case):
    changes, words = WRONG[case]
    path = write(**changes)
    with pytest.raises(TraceError) as caught:
        check(MINI, path)
    message = str(caught.value)
    assert message.startswith(f"{path}: ")
    assert words in message
    assert "\n" not in message


def test_requests_and_tanks_of_another_city(write):
    city, arrays = load_city_file(city_path("mini_brigades")), trace_arrays("mini_brigades")
    other = arrays["requests"].copy()
    other[5, 3] += 1
    cases = [
        ({"requests": other}, "requests, row 5 by step: expected the city's (step, brigade, target, litres) ["),
        ({"requests": other[:-1]}, "requests: expected the 67 requests of the city file, got 66 rows"),
        ({"requests": other[:, :4]}, "requests: expected shape (any, 5), got shape (67, 4)"),
        ({"tank": arrays["tank"][:, :5]}, "tank: expected shape (any, 6), got shape (61, 5)"),
        ({"tank": arrays["tank"][:9]}, "tank: expected 61 rows, got 9 rows"),
        ({"brigade_id": arrays["brigade_id"] + 1}, "brigade_id: expected the city's brigades [500, "),
    ]
    for changes, words in cases:
        with pytest.raises(TraceError) as caught:
            check(city, write("mini_brigades", **changes))
        assert words in str(caught.value)
    values = json.loads(str(arrays["params"]))
    del values["resq-fire.water_capacity"]
    with pytest.raises(TraceError, match=r"params: resq-fire\.water_capacity: expected this key to be set"):
        check(city, write("mini_brigades", params=np.array(json.dumps(values))))


def test_files_that_are_no_traces(tmp_path):
    data = trace_path("mini").read_bytes()
    single, objects = io.BytesIO(), io.BytesIO()
    np.save(single, np.arange(3))
    np.savez(objects, params=np.array([{}], dtype=object), fieryness=ARRAYS["fieryness"])
    foreign = io.BytesIO()
    with zipfile.ZipFile(foreign, "w") as archive:
        archive.writestr("params.npy", b"not an array")
    cases = [
        (b"", "expected a file with arrays (.npz)"),
        (b"hello, trace", "expected a file with arrays (.npz)"),
        (city_path("mini").read_bytes(), "expected a file with arrays (.npz)"),
        (data[: len(data) // 2], "expected a file with arrays (.npz)"),
        (single.getvalue(), "expected a file with arrays (.npz)"),
        (objects.getvalue(), "params: expected an array of numbers or text, got objects"),
        (foreign.getvalue(), "params: expected an array of numbers or text"),
    ]
    path = tmp_path / "trace.npz"
    for content, words in cases:
        path.write_bytes(content)
        with pytest.raises(TraceError) as caught:
            check(MINI, path)
        assert str(caught.value).startswith(f"{path}: ")
        assert words in str(caught.value)
    for unreadable in (tmp_path / "nowhere.npz", tmp_path):
        with pytest.raises(TraceError, match="expected a file that can be read"):
            check(MINI, unreadable)


def test_programs_in_a_trace_never_run(tmp_path):
    class Program:
        def __reduce__(self):
            return (tmp_path.joinpath("ran").touch, ())

    path = tmp_path / "trace.npz"
    np.savez(path, allow_pickle=True, **ARRAYS | {"fieryness": np.array([Program()], dtype=object)})
    with pytest.raises(TraceError, match="fieryness: expected an array of numbers or text, got objects"):
        check(MINI, path)
    assert not (tmp_path / "ran").exists()


@given(st.data())
@settings(max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow])
def test_damaged_bytes(tmp_path, data):
    """Damage is refused in one line, or is where it changes nothing: an archive has checksums."""
    content = bytearray(trace_path("mini_brigades").read_bytes())
    for _ in range(data.draw(st.integers(1, 4))):
        near_the_end = data.draw(st.booleans())  # the directory of the archive is there
        place = data.draw(st.integers(-4000, -1) if near_the_end else st.integers(0, len(content) - 1))
        content[place] = data.draw(st.integers(0, 255))
    path = tmp_path / "trace.npz"
    path.write_bytes(content[: data.draw(st.integers(0, len(content)))] if data.draw(st.booleans()) else content)
    refusal = refusal_of(lambda: check(load_city_file(city_path("mini_brigades")), path))
    assert refusal is None or refusal.startswith(f"{path}: ")


ANY_ARRAY = st.one_of(
    st.sampled_from([np.array(None), np.array([]), np.array("x"), np.array(b"x"), np.array(1.5), np.array([[True]])]),
    st.builds(
        lambda shape, kind, fill: np.full(shape, fill).astype(kind),
        st.sampled_from([(), (1,), (2,), (12,), (13,), (63,), (12, 12), (121, 12), (5, 12), (0, 12), (121, 9, 11)]),
        st.sampled_from(["u1", "i4", "f4", "f8", "f2", ">f8", "?", "i8", "U5", "c16", "O"]),
        st.sampled_from([0, 1, 2, 7]),
    ),
)


@given(st.dictionaries(st.sampled_from(sorted(ARRAYS)), ANY_ARRAY, min_size=1, max_size=3))
@settings(max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow])
def test_any_arrays(tmp_path, changes):
    """Whatever the arrays are, there is a report or one line."""
    path = tmp_path / "trace.npz"
    np.savez(path, **{key: ARRAYS[key] for key in ARRAYS if key not in {"air", "rays"}} | changes)
    refusal = refusal_of(lambda: check(MINI, path))
    assert refusal is None or refusal.startswith(f"{path}: ")


CITY_WRONG = {
    "an unknown fire": ({"ignitions": [8]}, "ignitions.0: expected the id of a building of this city, got 8"),
    "a fire without id": ({"ignitions": [None]}, "ignitions.0: expected the id of a building"),
    "a true fire": ({"ignitions": [True]}, "ignitions.0: expected the id of a building"),
    "no list of fires": ({"ignitions": 7}, "ignitions: expected an array, got a number"),
    "a later unknown fire": ({"later_ignitions": [{"t": 1, "id": 8}]}, "later_ignitions.0.id: expected the id"),
    "a fire at no step": ({"later_ignitions": [{"id": 7}]}, "later_ignitions.0.t: expected this key to be there"),
    "a fire before the start": (
        {"later_ignitions": [{"t": 0, "id": 7}]},
        "later_ignitions.0.t: expected a whole number",
    ),
    "a slip": ({"later_ignitions": [{"t": 1, "id": 7, "T": 2}]}, "later_ignitions.0.T: expected one of the keys t, id"),
    "water on nothing": ({"water": [[1, 8, 100]]}, "water.0.id: expected the id of a building of this city, got 8"),
    "water of no measure": ({"water": [[1, 7]]}, "water.0: expected a row [step, building, litres], got [1, 7]"),
    "negative water": ({"water": [[1, 7, -1]]}, "water.0.litres: expected a whole number from 0"),
    "half a litre": ({"water": [[1, 7, 0.5]]}, "water.0.litres: expected a whole number from 0"),
    "two brigades of one id": (
        {"brigades": [{"id": 1, "x": 0, "y": 0, "water": 0}] * 2},
        "brigades.0.id: expected an identifier of its own, got 1",
    ),
    "a brigade nowhere": ({"brigades": [{"id": 1, "x": 0, "water": 0}]}, "brigades.0.y: expected this key to be there"),
    "a place with a name": (
        {"brigades": [{"id": 1, "x": 0, "y": 0, "water": 0, "pos": "home"}]},
        "brigades.0.pos: expected a whole number",
    ),
    "an unknown brigade moves": (
        {"brigade_moves": [{"t": 1, "id": 3, "x": 0, "y": 0, "pos": None}]},
        "brigade_moves.0.id: expected the id of a brigade of this city, got 3",
    ),
    "a request for nothing": (
        {"extinguish": [{"t": 1, "brigade": 1, "target": 8, "litres": 5}]},
        "extinguish.0.target: expected the id of a building of this city, got 8",
    ),
}


@pytest.mark.parametrize("case", CITY_WRONG)
def test_malformed_cities(write_city, case):
    changes, words = CITY_WRONG[case]
    path = write_city(**changes)
    with pytest.raises(CityError) as caught:
        load_city_file(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_cities_that_cannot_be_read(tmp_path):
    path = tmp_path / "city.json"
    with pytest.raises(CityError, match="expected a city file that can be read"):
        load_city_file(path)
    for content in (b"", b"{", b"[]", b"\xff", b'{"buildings": []}', trace_path("mini").read_bytes()):
        path.write_bytes(content)
        with pytest.raises(CityError) as caught:
            load_city_file(path)
        assert str(caught.value).startswith(f"{path}: ")


JSON_VALUE = st.recursive(
    st.none() | st.booleans() | st.integers(-5, 2**40) | st.floats(allow_nan=False) | st.text(max_size=3),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.sampled_from(["t", "id", "x"]), inner, max_size=3),
    max_leaves=6,
)
EVENT_KEYS = ["ignitions", "later_ignitions", "water", "brigades", "brigade_moves", "extinguish", "hydrants"]


@given(st.dictionaries(st.sampled_from(EVENT_KEYS), JSON_VALUE, min_size=1))
@settings(max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow])
def test_any_events(tmp_path, changes):
    """Whatever a city file says of the run, it is read or refused in one line."""
    path = tmp_path / "city.json"
    path.write_text(json.dumps(json.loads(city_path("mini").read_text()) | changes))
    refusal = refusal_of(lambda: load_city_file(path))
    assert refusal is None or refusal.startswith(f"{path}: ")


def test_air_cells_too_coarse_for_a_building(write_city, write):
    """What only the building of the city shows is told of the city file too."""
    document = json.loads(city_path("mini").read_text())
    document["buildings"][1]["apexes"] = [20100, 5100, 21400, 5100, 21400, 6400, 20100, 6400]
    city = load_city_file(write_city(buildings=document["buildings"]))
    path = write(**params(**{"resq-fire.cell_size": "100000"}))
    with pytest.raises(CityError) as caught:
        check(city, path)
    assert str(caught.value).startswith(f"{city.where}: building ")
