"""The engine passes every trace of the official program, and every kind of difference is found and located."""

import json

import numpy as np
import pytest

from fireworld.conformance.check import check
from fireworld.conformance.city_file import load_city_file
from tests.conformance.conftest import city_path, trace_arrays, trace_path
from tests.reference.traces import CITIES

MINI = load_city_file(city_path("mini"))


def parameters(**changes):
    """The configuration of `mini` with some keys changed or (None) left out."""
    values = json.loads(str(trace_arrays("mini")["params"]))
    values |= {f"resq-fire.{key.replace('__', '-')}": value for key, value in changes.items()}
    return np.array(json.dumps({key: value for key, value in values.items() if value is not None}))


@pytest.mark.parametrize("name", CITIES)
def test_every_trace_passes(name):
    report = check(load_city_file(city_path(name)), trace_path(name))
    arrays = trace_arrays(name)
    assert report.passed
    assert report.first_difference is None
    assert report.notes == ()
    assert report.n_steps == len(arrays["fieryness"]) - 1
    assert report.n_buildings == len(arrays["id"])
    assert report.tallies["fieryness"].n_compared == arrays["fieryness"].size
    for output in ("energy", "temperature", "fuel", "water", "air", "ever_watered", "tank"):
        if output in arrays:
            assert report.tallies[output].n_compared == arrays[output].size
    assert report.tallies["energy"].largest < 1e-12
    if name == "mini_brigades":
        assert report.tallies["requests"].n_compared == len(arrays["requests"])


@pytest.mark.parametrize(
    ("output", "change", "words"),
    [
        ("fieryness", 3, "code 2 here, 3 in the trace"),
        ("energy", 1.0000001, "energy "),
        ("temperature", 1.0000001, "temperature "),
        ("fuel", 1.0000002, "fuel "),
        ("water", 5, "water 0 here, 5 in the trace"),
        ("ever_watered", 1, "ever_watered 0 here, 1 in the trace"),
    ],
)
def test_the_first_difference_is_located(write, output, change, words):
    values = trace_arrays("mini")[output]
    step = int(np.argmax(trace_arrays("mini")["fieryness"][:, 3] == 2))
    for later in (step, step + 5):
        values[later, 3] = values[later, 3] * change if isinstance(change, float) else change
    report = check(MINI, write(**{output: values}))
    assert not report.passed
    assert report.tallies[output].n_differing == 2
    assert sum(tally.n_differing for tally in report.tallies.values()) == 2
    sentence = report.first_difference.sentence
    assert sentence.startswith(f"step {step}, building {trace_arrays('mini')['id'][3]}: ")
    assert words in sentence
    assert "code 2 here" in sentence
    assert "energy " in sentence


def test_differences_within_rounding_are_none(write):
    energy = trace_arrays("mini")["energy"]
    assert check(MINI, write(energy=energy * (1 + 9e-10))).passed
    assert not check(MINI, write(energy=energy * (1 + 2e-9))).passed
    assert check(MINI, write(energy=energy + 9e-10 * trace_arrays("mini")["capacity"])).passed


def test_energies_in_single_precision_are_compared_in_single_precision(write):
    arrays = trace_arrays("mini")
    assert check(MINI, write(energy=arrays["energy"].astype(np.float32))).passed
    assert not check(MINI, write(energy=(arrays["energy"] * (1 + 1e-6)).astype(np.float32))).passed


def test_air_of_one_cell(write):
    air = trace_arrays("mini")["air"]
    air[60, 4, 7] += 0.5
    report = check(MINI, write(air=air))
    assert report.tallies["air"].n_differing == 1
    assert report.first_difference.sentence.startswith("step 60, cell 4, 7: air ")


def test_requests_and_tanks(write):
    city = load_city_file(city_path("mini_brigades"))
    arrays = trace_arrays("mini_brigades")
    requests, tank = arrays["requests"].copy(), arrays["tank"].copy()
    requests[3, 4] = 1
    report = check(city, write("mini_brigades", requests=requests))
    assert report.tallies["requests"].n_differing == 1
    assert report.first_difference.sentence == "step 4, brigade 500 asks 1501 for 1031: result -2 here, 1 in the trace"
    tank[30, 2] += 1
    report = check(city, write("mini_brigades", tank=tank))
    assert report.tallies["tank"].n_differing == 1
    assert report.first_difference.sentence.startswith("step 30, brigade 502: tank ")


def test_tanks_in_another_order_of_brigades(write):
    city, arrays = load_city_file(city_path("mini_brigades")), trace_arrays("mini_brigades")
    columns = [4, 0, 5, 2, 1, 3]
    path = write("mini_brigades", tank=arrays["tank"][:, columns], brigade_id=arrays["brigade_id"][columns])
    assert check(city, path).passed
    assert not check(city, write("mini_brigades", tank=arrays["tank"][:, columns])).passed


@pytest.mark.parametrize(
    "name", ["wall_area", "volume", "capacity", "init_fuel", "ignition_point", "cell_pct", "ray_base", "walls", "x"]
)
def test_a_table_derived_otherwise(write, name):
    table = trace_arrays("mini")[name]
    table[2] = table[2] + 1
    report = check(MINI, write(**{name: table}))
    assert not report.passed
    assert [difference.table for difference in report.tables] == [name]
    assert report.tables[0].n_differing == 1
    place = "entry 2" if name in {"cell_pct", "walls"} else f"building {trace_arrays('mini')['id'][2]}"
    assert f"{name}: 1 of {len(table)} differ, the first is {place}: " in report.tables[0].sentence


def test_another_order_is_a_table_of_its_own_and_changes_the_fire(write):
    """The replay follows the trace's order; that it is not the official one is told as well."""
    report = check(MINI, write(order=trace_arrays("mini")["order"][::-1]))
    assert [difference.table for difference in report.tables] == ["order"]
    assert report.tallies["energy"].n_differing > 0


def test_another_air_grid(write):
    arrays = trace_arrays("mini")
    path = write(grid_shape=np.array([10, 11]), air=np.zeros((121, 10, 11)), cell_x=arrays["cell_x"][:-1])
    report = check(MINI, path)
    assert [difference.table for difference in report.tables] == ["grid_shape", "cell_x"]
    assert "air" not in report.tallies
    assert report.tallies["fieryness"].n_differing == 0


def test_other_number_types(write):
    arrays = trace_arrays("mini")
    changes = {
        "fieryness": arrays["fieryness"].astype(">i8"),
        "fuel": arrays["fuel"].astype(np.float64),
        "water": arrays["water"].astype(np.float32),
        "order": arrays["order"].astype(np.uint16),
        "conn_ptr": arrays["conn_ptr"].astype(np.float64),
        "conn_val": arrays["conn_val"].astype(np.float64),
        "inflammable": arrays["inflammable"].astype(bool),
        "air_t": arrays["air_t"].astype(np.int64),
        "wall_area": arrays["wall_area"].astype(np.float32),
        "params": np.array([str(arrays["params"]).encode()]),
    }
    assert check(MINI, write(**changes)).passed


def test_only_what_is_needed(write):
    """A trace of another simulator: parameters and codes, with fireworld's own order and links."""
    needed = {"params", "fieryness", "burn_rate_draws", "conn_ptr", "conn_idx", "conn_val"}
    gone = {key: None for key in trace_arrays("mini") if key not in needed}
    report = check(MINI, write(**gone))
    assert report.passed
    assert list(report.tallies) == ["fieryness"]
    assert report.notes == (
        "the trace has no order: fireworld's own is used",
        "the trace has no energies: only what it has is compared",
    )
    report = check(MINI, write(conn_ptr=None, conn_idx=None, conn_val=None))
    assert "the trace has no links" in report.notes[0]
    assert not report.passed


def test_constant_burn_rates_need_no_list(write):
    assert check(MINI, write(burn_rate_draws=None)).passed
    assert not check(MINI, write(burn_rate_draws=None, params=parameters(burn__rate__average="0.2"))).passed
    path = write(params=parameters(burn__rate__average=None, burn__rate__variance=None, ray_rate=None))
    assert check(MINI, path).passed, "parameters that nothing needs may be missing"


def test_a_list_of_burn_rates_for_each_building(write):
    """Every building may have its own: here the common one, and for buildings that never burn another."""
    arrays = trace_arrays("mini_sd")
    each = np.tile(arrays["burn_rate_draws"], (12, 1))
    burns = ((arrays["fieryness"] >= 1) & (arrays["fieryness"] <= 3)).any(axis=0)
    assert 0 < burns.sum() < 12
    each[~burns] = 0.9
    assert check(MINI, write("mini_sd", burn_rate_draws=each)).passed
    each[burns] = 0.9
    assert not check(MINI, write("mini_sd", burn_rate_draws=each)).passed


def test_no_requests_at_all(write):
    assert check(MINI, write(requests=np.array([]), tank=np.zeros((121, 0)), brigade_id=np.array([]))).passed


def test_thin_traces(write):
    arrays, kept = trace_arrays("mini"), np.array([0, 7, 50, 119])
    thin = {key: arrays[key][kept] for key in ("energy", "temperature", "fuel", "water", "ever_watered")}
    report = check(MINI, write(steps=kept, **thin))
    assert report.passed
    assert report.tallies["energy"].n_compared == 4 * 12
    thin["energy"][2, 5] *= 1.01
    assert check(MINI, write(steps=kept, **thin)).first_difference.step == 50


def test_codes_between_the_kept_rows_are_compared(write):
    arrays, kept = trace_arrays("mini"), np.array([0, 120])
    codes = arrays["fieryness"]
    codes[60, 1] = (codes[60, 1] + 1) % 9
    report = check(
        MINI,
        write(
            steps=kept,
            fieryness=codes,
            **dict.fromkeys(("temperature", "fuel", "water")),
            ever_watered=None,
            energy=arrays["energy"][kept],
        ),
    )
    assert report.first_difference.step == 60
    assert "not kept in the trace" in report.first_difference.sentence


def test_a_shorter_trace(write):
    arrays = trace_arrays("mini")
    shorter = {key: value[:31] for key, value in arrays.items() if value.shape[:1] == (121,)}
    report = check(MINI, write(**shorter))
    assert report.passed
    assert report.n_steps == 30


def test_fires_and_water_where_nothing_burns(write, write_city):
    """Large ids, fire and water on stone, several rows in one step: the codes are what the model says they are."""
    document = json.loads(city_path("mini").read_text())
    buildings = [building | {"id": building["id"] + 2**20} for building in document["buildings"]]
    buildings[0]["inflammable"] = False
    stone, wet = buildings[0]["id"], buildings[1]["id"]
    city = load_city_file(
        write_city(
            buildings=buildings,
            ignitions=[stone, stone],
            later_ignitions=[{"t": 2, "id": stone}, {"t": 2, "id": wet}, {"t": 2, "id": wet}, {"t": 9, "id": wet}],
            water=[[1, stone, 100], [1, wet, 200], [1, wet, 0], [1, wet, 50], [5, wet, 1]],
        )
    )
    codes = np.zeros((3, 12), dtype=np.uint8)
    codes[1, 1], codes[2, 1] = 4, 1
    water = np.zeros((2, 12), dtype=np.int32)
    water[1, :2] = 100, 250
    gone = {key: None for key in trace_arrays("mini") if key not in {"params", "burn_rate_draws"}}
    flags = city.plan.footprints.inflammable
    report = check(city, write(**gone | {"fieryness": codes, "water": water, "steps": [0, 1], "inflammable": flags}))
    assert report.passed, report.first_difference
    assert report.tallies["water"].n_compared == 24
