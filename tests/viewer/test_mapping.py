"""What is written to a Rerun file is what the recording holds, at every step."""

from __future__ import annotations

import itertools
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
import rerun
from fireworld_viewer import colors
from fireworld_viewer.city_mesh import SHADES_PERCENT, build_mesh
from fireworld_viewer.rerun_view import app, brigades, layers, run_layers
from fireworld_viewer.rerun_view.plots import COUNTS, REWARDS, SCORES, first_burning
from fireworld_viewer.story import steps

from fireworld.errors import ViewError
from fireworld.records import ACTION_NAMES, ACTIVITIES, STEP_TOPICS, MemoryRecording
from tests.viewer import rrd
from tests.viewer.conftest import make_recording


@pytest.fixture(scope="module")
def saved(small: MemoryRecording, tmp_path_factory: pytest.TempPathFactory) -> dict[str, rrd.Rows]:
    path = tmp_path_factory.mktemp("view") / "small.rrd"
    app.save([small], path, focus=[121, 100])
    return rrd.read(path)


def test_every_building_has_its_color_at_every_step(small, saved):
    shown = rrd.building_colors(saved, "/city/buildings", small.steps.tolist(), len(small.city.building_id))
    refuges = set(small.city.refuge_building.tolist())
    assert len(shown) == len(list(small))
    for record, rgb in zip(small, shown, strict=True):
        for building, code in enumerate(record.buildings.fieryness.tolist()):
            wanted = colors.REFUGE_RGB if building in refuges else colors.FIERYNESS_RGB[code]
            assert tuple(rgb[building].tolist()) == wanted


def test_every_vertex_has_the_pixel_of_its_building_and_the_shade_of_its_face(small, saved):
    mesh, sent = build_mesh(small.city), saved["/city/buildings"]
    ((_, picture),), ((_, uv),), ((_, shade),) = (
        sent[f"Mesh3D:{name}"] for name in ("albedo_texture_format", "vertex_texcoords", "vertex_colors")
    )
    (size,) = picture.as_py()
    (_, first), *_ = sent["Mesh3D:albedo_texture_buffer"]
    assert len(first.as_py()[0]) == 3 * size["width"] * size["height"]
    column, row = np.floor(np.array(uv.as_py()) * (size["width"], size["height"])).astype(int).T
    assert np.array_equal(row * size["width"] + column, mesh.vertex_building)
    grey = np.array([255 * percent // 100 for percent in SHADES_PERCENT])[mesh.vertex_shade]
    assert np.array_equal(shade.as_py(), grey << 24 | grey << 16 | grey << 8 | 255)


def test_geometry_is_sent_once_and_colors_only_when_they_change(small, saved):
    mesh = saved["/city/buildings"]
    assert [step for step, _ in mesh["Mesh3D:vertex_positions"]] == [None]
    codes = small.column("/buildings", "fieryness")
    changes = [0, *(np.flatnonzero(np.any(codes[1:] != codes[:-1], axis=1)) + 1).tolist()]
    assert [step for step, _ in mesh["Mesh3D:albedo_texture_buffer"]] == changes
    assert len(changes) < len(codes)


@pytest.mark.parametrize("name", ["temperature", "fuel_share", "water_litres", "fieryness"])
def test_handles_carry_the_numbers_of_every_building(small, saved, name: str):
    shown = rrd.at_every_step(saved["/city/handles"][f"Building:{name}"], small.steps.tolist())
    assert np.array_equal(np.array(shown), small.column("/buildings", name))


def test_handles_sit_on_the_roofs_and_know_their_buildings(small, saved):
    handles = saved["/city/handles"]
    (_, positions), (_, ids) = handles["Points3D:positions"][0], handles["Facts:id"][0]
    assert ids.as_py() == small.city.building_id.tolist()
    xyz = np.array(positions.as_py())
    assert np.allclose(xyz[:, 0], small.city.center_x_m, atol=1e-4)
    assert np.all(xyz[:, 2] > 3 * small.city.floors)


@pytest.mark.parametrize(
    ("path", "fields"),
    [("reward", REWARDS), *((path, (field,)) for path, field in {**SCORES, **COUNTS}.items())],
)
def test_plots_hold_the_recorded_scalars(small, saved, path: str, fields: tuple[str, ...]):
    shown = rrd.at_every_step(saved[f"/plots/{path}"]["Scalars:scalars"], small.steps.tolist())
    assert np.array_equal(np.array(shown), np.column_stack([small.column(*field.split(".")) for field in fields]))


def test_tanks_and_the_focus_are_plotted(small, saved):
    steps = small.steps.tolist()
    tanks = rrd.at_every_step(saved["/plots/tanks"]["Scalars:scalars"], steps)
    assert np.array_equal(np.array(tanks), small.column("/brigades", "tank_litres"))
    focus = rrd.at_every_step(saved["/plots/focus"]["Scalars:scalars"], steps)
    assert np.array_equal(np.array(focus), small.column("/buildings", "temperature")[:, [21, 0]])
    (_, names) = saved["/plots/focus"]["SeriesLines:names"][0]
    assert names.as_py() == ["building 121", "building 100"]


def test_brigades_stand_where_they_are_in_the_color_of_what_they_do(small, saved):
    steps = small.steps.tolist()
    brigades = saved["/team/brigades"]
    xyz = np.array(rrd.at_every_step(brigades["Points3D:positions"], steps))
    assert np.allclose(xyz[..., 0], small.column("/brigades", "x_m"))
    assert np.allclose(xyz[..., 1], small.column("/brigades", "y_m"))
    activity = small.column("/brigades", "activity")
    shown = np.array(rrd.at_every_step(brigades["Points3D:colors"], steps))
    assert np.array_equal(shown, colors.packed_table(colors.ACTIVITY_RGB)[activity])
    labels = rrd.at_every_step(saved["/team/names"]["Points3D:labels"], steps)
    for row, shown_labels in zip(xyz, labels, strict=True):
        assert sorted(int(one) for label in shown_labels for one in label.split(", ")) == list(range(len(row)))


def test_gauges_are_as_high_as_the_tanks_are_full(small, saved):
    halves = np.array(rrd.at_every_step(saved["/team/tanks"]["Boxes3D:half_sizes"], small.steps.tolist()))
    share = small.column("/brigades", "tank_litres") / small.city.brigade_tank_litres
    assert np.allclose(halves[..., 2] / halves[..., 2].max(), share / share.max(), atol=1e-6)


def test_a_jet_runs_from_each_spraying_brigade_to_its_target(small, saved):
    jets = rrd.at_every_step(saved["/team/water"]["LineStrips3D:strips"], small.steps.tolist())
    n_jets = 0
    for record, strips in zip(small, jets, strict=True):
        aims = record.decisions.target if record.step else np.full(3, -1)
        sprays = np.flatnonzero((record.brigades.sprayed_litres > 0) & (aims >= 0))
        assert len(strips) == len(sprays)
        for strip, brigade in zip(strips, sprays.tolist(), strict=True):
            target = aims[brigade]
            assert strip[0][0] == pytest.approx(record.brigades.x_m[brigade])
            assert strip[-1][0] == pytest.approx(small.city.center_x_m[target])
            assert strip[-1][1] == pytest.approx(small.city.center_y_m[target])
            n_jets += 1
    assert n_jets > 0


def test_civilians_are_colored_by_health_and_stand_above_their_roofs(small, saved):
    shown = rrd.at_every_step(saved["/civilians"]["Points3D:colors"], small.steps.tolist())
    hp = small.column("/civilians", "hp")
    rgb = colors.health_rgb(hp, small.city.civilian_hp).astype(int)
    assert np.array_equal(np.array(shown), rgb[..., 0] << 24 | rgb[..., 1] << 16 | rgb[..., 2] << 8 | 255)
    assert len(np.unique(hp)) > 3
    (_, positions) = saved["/civilians"]["Points3D:positions"][0]
    assert np.all(np.array(positions.as_py())[:, 2] > 3 * small.city.floors[small.city.civilian_building])


def test_sites_and_their_free_sides(small, saved):
    steps = small.steps.tolist()
    boxes = rrd.at_every_step(saved["/fire/sites"]["Boxes3D:centers"], steps)
    sides = rrd.at_every_step(saved["/fire/free_sides"]["LineStrips3D:strips"], steps)
    for record, box, strips in zip(small, boxes, sides, strict=True):
        observed = record.observations
        assert len(box) == len(observed.site_id)
        assert len(strips) == 2 * len(observed.site_id)  # N and S are free in the made-up run
        for site in range(len(observed.site_id)):
            assert box[site][0] == pytest.approx((observed.site_west_m[site] + observed.site_east_m[site]) / 2)
            assert [point[1] for point in strips[0]] == pytest.approx([observed.site_north_m[site]] * 2)
            assert [point[1] for point in strips[1]] == pytest.approx([observed.site_south_m[site]] * 2)


def states_at_every_step(lane, steps: list[int]) -> list[list[str]]:
    """States without what makes one of them a state that shows no name."""
    every = rrd.at_every_step(lane, steps)
    return [[one.removesuffix(layers._UNNAMED) for one in states.tolist()] for states in every]


def test_bands_too_short_for_their_names_have_none(small, saved):
    lane = [(step, states.as_py()[0]) for step, states in saved["/brigade_0"]["StateChange:state"]]
    ends = [*(step for step, _ in lane[1:]), 41]
    named = {end - step: not state.endswith(layers._UNNAMED) for (step, state), end in zip(lane, ends, strict=True)}
    assert named[1] is False
    assert named[max(named)] is True
    (values, labels) = (
        saved["/brigade_0"][f"StateConfiguration:{name}"][0][1].as_py() for name in ("values", "labels")
    )
    shown = dict(zip(values, labels, strict=True))
    assert shown["spraying"] == "spraying"
    assert shown["spraying" + layers._UNNAMED].strip() == ""


def test_brigades_that_stand_together_share_a_label():
    x, y = np.array([[0.0, 15.0, 30.0, 100.0]]), np.zeros((1, 4))
    assert brigades.leaders(x, y, within_m=20.0).tolist() == [[0, 0, 2, 3]]
    assert brigades.leaders(x, y, within_m=1.0).tolist() == [[0, 1, 2, 3]]
    assert brigades.leaders(x, y, within_m=200.0).tolist() == [[0, 0, 0, 0]]


def test_lanes_change_where_activities_change(small, saved):
    for brigade in range(3):
        lane = saved[f"/brigade_{brigade}"]["StateChange:state"]
        shown = states_at_every_step(lane, small.steps.tolist())
        assert shown == [[ACTIVITIES[record.brigades.activity[brigade]]] for record in small]


def test_lanes_tell_the_actions_too(small, saved):
    for brigade in range(3):
        lane = saved[f"/chosen/brigade_{brigade}"]["StateChange:state"]
        shown = states_at_every_step(lane, small.steps.tolist())
        assert shown[0] == ["no choice"]
        assert shown[1:] == [[ACTION_NAMES[record.decisions.action[brigade]]] for record in list(small)[1:]]


def test_the_terms_of_the_reward_are_stacked_up_to_their_sum(small, saved):
    shown = np.array(rrd.at_every_step(saved["/plots/reward_stacked"]["Scalars:scalars"], small.steps.tolist()))
    terms = np.column_stack([small.column(*field.split(".")) for field in REWARDS[:4]])
    assert np.array_equal(shown[:, 0], terms[:, 0])
    assert np.array_equal(shown[:, 3], terms.sum(axis=1))


def test_values_of_choices_are_plotted_where_there_are_some(small, saved):
    for brigade in range(3):
        chosen, best = (
            rrd.at_every_step(saved[f"/plots/{plot}/brigade_{brigade}"]["Scalars:scalars"], small.steps.tolist())
            for plot in ("values", "values_best")
        )
        assert chosen[0].tolist() == best[0].tolist() == []  # nobody is asked before the first step
        for record, own, most in zip(list(small)[1:], chosen[1:], best[1:], strict=True):
            assert own.tolist() == [4 * brigade + record.decisions.action[brigade]]
            assert most.tolist() == [4 * brigade + 3]


def test_what_a_brigade_chose_is_told_when_it_is_clicked(small, saved):
    steps = small.steps.tolist()
    brigades = saved["/team/brigades"]
    for name in ("action", "target"):
        shown = np.array(rrd.at_every_step(brigades[f"Brigade:{name}"], steps))
        assert np.array_equal(shown[1:], [getattr(record.decisions, name) for record in list(small)[1:]])
    easiest = rrd.at_every_step(brigades["Brigade:value_easiest"], steps)
    assert easiest[0].tolist() == [None] * 3
    assert easiest[1].tolist() == [0.0, 4.0, 8.0]


def test_the_buildings_that_burn_first_are_plotted_if_none_are_named(small, tmp_path: Path):
    app.save([small], tmp_path / "run.rrd")
    (_, names) = rrd.read(tmp_path / "run.rrd")["/plots/focus"]["SeriesLines:names"][0]
    assert first_burning(small, 4) == [int(name.removeprefix("building ")) for name in names.as_py()]
    codes = small.column("/buildings", "fieryness")
    began = np.where(codes.any(axis=0), (codes != 0).argmax(axis=0), 99)
    chosen = [small.city.building_id.tolist().index(identifier) for identifier in first_burning(small, 4)]
    assert sorted(began[chosen]) == sorted(began)[:4]


def test_what_is_wide_is_taken_block_by_block(small, tmp_path: Path, monkeypatch):
    """Each block of a large city can be compressed and written before the next one is made."""
    monkeypatch.setattr(layers, "CHUNK_BYTES", 1)
    stream = rerun.RecordingStream("test", recording_id="blocks", send_properties=False)
    stream.save(tmp_path / "blocks.rrd")
    sizes = list[int]()

    def after_block() -> None:
        stream.flush()
        sizes.append((tmp_path / "blocks.rrd").stat().st_size)

    run_layers.RunLayers(stream, small.city, after_block=after_block).add(small)
    stream.disconnect()
    assert len(sizes) > len(small.steps)
    assert all(before < after for before, after in itertools.pairwise(sizes))


def test_a_run_sent_in_parts_shows_the_same(small, saved, tmp_path: Path, monkeypatch):
    monkeypatch.setattr(run_layers, "PART_BYTES", 7 * 21 * len(small.city.building_id))
    app.save([small], tmp_path / "parts.rrd", focus=[121, 100])
    found = rrd.read(tmp_path / "parts.rrd")
    assert set(found) == set(saved)
    for path, components in found.items():
        for name, rows in components.items():
            assert sorted(rows, key=str) == sorted(saved[path][name], key=str), (path, name)


def test_steps_sent_one_by_one_show_the_same_as_all_at_once(small, saved, tmp_path: Path):
    stream = rerun.RecordingStream("test", recording_id="one-by-one", send_properties=False)
    stream.set_log_time_enabled(False)
    stream.set_log_tick_enabled(False)
    memory = stream.memory_recording()
    sent = run_layers.RunLayers(stream, small.city, focus=[121, 100])
    for record in small:
        sent.add(MemoryRecording(small.header, small.city, [record]))
    (tmp_path / "parts.rrd").write_bytes(memory.drain_as_bytes())
    found = rrd.read(tmp_path / "parts.rrd")
    assert set(found) == {path for path in saved if not path.startswith(("/legend", "/help", "/__prop"))}
    for path, components in found.items():
        assert set(components) == set(saved[path]), path
        for name, rows in components.items():
            whole = saved[path][name]
            if "brigade_" in path and name.startswith("StateChange"):  # how long a band lasts is known at its end
                assert states_at_every_step(rows, small.steps.tolist()) == states_at_every_step(
                    whole, small.steps.tolist()
                )
                continue
            if path == "/team/names":  # it is not known from how far they will be seen
                continue
            n_before = next(place for place, (_, value) in enumerate(whole) if value.as_py() != [] or path == "/")
            assert rows == whole[n_before:], (path, name)  # what is not there yet is nothing in both


def test_a_fire_that_goes_out_leaves_no_box_when_steps_come_one_by_one(tmp_path: Path):
    recording = make_recording(4, 4, 2)
    last = list(recording)[-1]
    gone = {name: np.zeros(0) for name in ("site_west_m", "site_south_m", "site_east_m", "site_north_m")}
    out = replace(
        last,
        step=3,
        observations=replace(
            last.observations, site_id=np.zeros(0, "<i4"), site_free_sides=np.zeros(0, "u1"), **gone,
            site_n_burning=np.zeros(0, "<i4"),
        ),
        brigades=replace(last.brigades, sprayed_litres=np.zeros(3, "<i4")),
    )  # fmt: skip
    stream = rerun.RecordingStream("test", recording_id="out", send_properties=False)
    memory = stream.memory_recording()
    sent = run_layers.RunLayers(stream, recording.city)
    for record in [*recording, out]:
        sent.add(MemoryRecording(recording.header, recording.city, [record]))
    (tmp_path / "out.rrd").write_bytes(memory.drain_as_bytes())
    found = rrd.read(tmp_path / "out.rrd", timelines={"step", "log_time", "log_tick"})
    for path, name in (
        ("/fire/sites", "Boxes3D:centers"),
        ("/fire/free_sides", "LineStrips3D:strips"),
        ("/team/water", "LineStrips3D:strips"),
    ):
        steps = [step for step, _ in found[path][name]]
        assert steps[-1] == 3
        assert found[path][name][-1][1].as_py() == []


def test_the_log_tells_events_and_new_choices(small, saved):
    events = [(step, text.as_py()[0]) for step, text in saved["/log/events"]["TextLog:text"]]
    wanted = sum(len(record.events.kind) for record in small)
    assert len(events) == wanted
    assert (6, "6  brigade 0: tank empty") in events
    first = next(record for record in small if 0 in record.events.kind)
    assert events[0] == (first.step, f"{first.step}  building {small.city.building_id[first.events.entity[0]]} ignited")
    choices = [(step, text.as_py()[0]) for step, text in saved["/log/decisions"]["TextLog:text"]]
    target = small.city.building_id[list(small)[1].decisions.target]
    ways = "nearest-to-civilian", "nearest-to-center", "nearest-to-me"
    state = f"{ways[2]}, state 0: free edges 0, center low, civilian low, volume very-low, others nothing"
    assert choices[:3] == [
        (1, f"1  brigade 0: easiest → building {target[0]}, Q 0 against 3 of {state}"),
        (1, f"1  brigade 1: {ways[0]} → building {target[1]} (exploring), Q 5 against 7 of {state}"),
        (1, f"1  brigade 2: {ways[1]} → building {target[2]}, Q 10 against 11 of {state}"),
    ]
    assert len(choices) < 3 * len(small.steps)


def test_the_page_on_the_viewer_names_every_path(saved):
    page = (Path(__file__).parents[2] / "docs" / "viewer.md").read_text(encoding="utf-8")
    for path in set(saved) - {"/", "/__properties"}:
        if path.endswith(("/brigade_1", "/brigade_2")):
            continue
        assert f"`{path}`" in page, path


def test_no_entity_stands_for_a_single_building(saved):
    assert len(saved) < 45


def test_brigades_on_one_spot_are_drawn_side_by_side():
    recording = make_recording(4, 4, 2)
    for record in recording:
        record.brigades.x_m[:] = [5.0, 5.0, 5.0]
        record.brigades.x_m[1] = 6.0
    xyz = brigades.positions_m(recording)
    assert xyz[0, :, 0].tolist() == [5.0, 6.0, 13.0]


def test_a_city_without_people_or_fire_sites_can_be_shown(tmp_path: Path):
    recording = make_recording(3, 3, 0, n_brigades=0, n_civilians=0)
    app.save([recording], tmp_path / "empty.rrd")
    found = rrd.read(tmp_path / "empty.rrd")
    assert "/city/buildings" in found
    assert not {"/civilians", "/team/brigades", "/fire/sites", "/log/events"} & set(found)


def test_an_unknown_focus_is_named(small, tmp_path: Path):
    with pytest.raises(ViewError, match=r"--focus: expected ids of buildings of city 'grid', got 7; .*100, 101, 102"):
        app.save([small], tmp_path / "x.rrd", focus=[100, 7])
    assert list(tmp_path.iterdir()) == []


def test_a_thousand_buildings_for_300_steps_stay_small(big, tmp_path: Path):
    app.save([big], tmp_path / "big.rrd")
    assert (tmp_path / "big.rrd").stat().st_size < 8_000_000


def test_the_page_of_help_says_whom_the_map_is_by(small, saved, tmp_path: Path):
    recording = MemoryRecording(small.header, replace(small.city, attribution="© mappers"), list(small)[:2])
    app.save([recording], tmp_path / "a.rrd")
    (text,) = [rows[0][1].as_py()[0] for name, rows in rrd.read(tmp_path / "a.rrd")["/help"].items() if "text" in name]
    (before,) = [rows[0][1].as_py()[0] for name, rows in saved["/help"].items() if "text" in name]
    assert text == f"{before}\nMap: © mappers\n"


def test_steps_that_would_fill_the_memory_are_read_again(small, tmp_path: Path, monkeypatch):
    """Of a large city the numbers of buildings and snapshots are not held; what is shown is the same."""
    held = steps.select_steps(small, first=3, every=4)
    monkeypatch.setattr(steps, "HELD_MAX", 0)
    read = steps.select_steps(small, first=3, every=4)
    assert isinstance(held, MemoryRecording)
    assert isinstance(read, steps.SelectedSteps)
    assert read.steps.tolist() == held.steps.tolist() == list(range(3, 41, 4))
    for topic in STEP_TOPICS:
        for item in fields(topic):
            for one, other in zip(
                read.ragged(topic.topic, item.name), held.ragged(topic.topic, item.name), strict=True
            ):
                assert np.array_equal(one, other), (topic, item.name)
    app.save([held], tmp_path / "held.rrd")
    app.save([read], tmp_path / "read.rrd")
    assert rrd.read(tmp_path / "read.rrd") == rrd.read(tmp_path / "held.rrd")


def test_pictures_hold_no_numbers_of_buildings(small):
    for shown in steps.read_steps_between([small, small]):
        for record in shown.records:
            assert record.snapshot is None
            assert not len(record.buildings.energy)
            assert len(record.buildings.fieryness) == len(small.city.building_id)
