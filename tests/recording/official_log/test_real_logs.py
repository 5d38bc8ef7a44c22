"""Logs that real kernels wrote, against the answers that were worked out from them otherwise."""

import json

import numpy as np
import pytest

import fireworld as fw
from tests.real_data import real_file


def test_every_code_and_temperature_of_a_whole_run_is_right(here):
    run = fw.import_log(real_file("logs/test-2021-300steps.log.lzma"), "old.mcap").open()
    wanted = json.loads(real_file("logs/test-2021-city.json").read_bytes())["buildings"]
    ids = run.city.building_id.tolist()
    order = [ids.index(building["id"]) for building in wanted]
    assert len(ids) == len(wanted) == 37
    codes = np.load(real_file("logs/test-2021-trace.npz"))["fieryness"]
    assert np.array_equal(run.column("buildings.fieryness")[:, order], codes)
    temperature = np.load(real_file("logs/test-2021-temperature.npy"))
    assert np.array_equal(run.column("buildings.temperature")[:, order], temperature)
    for index, building in zip(order, wanted, strict=True):
        begin, end = run.city.outline_ptr[index : index + 2]
        corners = np.column_stack([run.city.outline_x_m[begin:end], run.city.outline_y_m[begin:end]]) * 1000
        assert np.rint(corners).astype(int).ravel().tolist() == building["apexes"]
        assert run.city.floors[index] == building["floors"]
        assert run.city.material[index] == building["code"]
        assert run.city.ground_area_m2[index] == building["ground_area"]
        assert bool(run.city.inflammable[index]) == building["inflammable"]
        assert round(run.city.center_x_m[index] * 1000) == building["x"]
        assert round(run.city.center_y_m[index] * 1000) == building["y"]


@pytest.mark.parametrize(
    ("name", "form", "n_steps", "n_buildings", "n_civilians", "cut_off"),
    [
        ("test-2021-300steps.log.lzma", "protobuf, lzma, numbers of 2021", 301, 37, 5, False),
        ("test-2022-7steps.log.xz", "protobuf, lzma, numbers of 2022 and later", 8, 37, 5, False),
        ("test-2021.json.lzma", "JSON, lzma, names as texts", 31, 37, 5, False),
        ("old-format-initial-only.log.xz", "the form before 2021, xz, names as texts", 1, 757, 162, True),
    ],
)
def test_every_real_log_is_read(here, name, form, n_steps, n_buildings, n_civilians, cut_off):
    found = fw.import_log(real_file(f"logs/{name}"), "found.mcap")
    assert (found.form, found.n_steps) == (form, n_steps)
    assert (found.outcome.n_buildings, found.outcome.n_civilians) == (n_buildings, n_civilians)
    assert (found.damage is not None) == cut_off
    assert found.official.function == "LegacyScoreFunction"
    assert found.official.value == pytest.approx(found.official.ours, rel=1e-3)
