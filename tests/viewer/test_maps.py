"""Still maps: the colors of the table, what is on the map, and the same bytes every time."""

from __future__ import annotations

import signal
from dataclasses import replace
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from fireworld_viewer import colors
from fireworld_viewer.pictures import maps
from fireworld_viewer.pictures.city_map import BrigadeMarks, MapState, contrasting, state_of
from fireworld_viewer.pictures.extent import fire_extent, whole_extent
from fireworld_viewer.pictures.figure_files import INK, plain_style, save_figure
from fireworld_viewer.pictures.map_grid import LABELS, MapGrid, count_marks, labels_on
from fireworld_viewer.story.steps import LAST, evenly_spaced, read_steps, read_steps_between
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import to_rgba

from fireworld.errors import OutputError, ViewError
from fireworld.records import FIERYNESS, MemoryRecording
from tests.viewer.conftest import make_recording


def legend_of(figure):
    (legend,) = [axes.get_legend() for axes in figure.axes if axes.get_legend() is not None]
    return [text.get_text() for text in legend.get_texts()]


def texts_of(figure):
    return [text.get_text() for text in figure.texts]


def test_buildings_have_the_colors_of_their_codes(small):
    record = list(small)[12]
    figure = maps.draw_map(small.city, fieryness=record.buildings.fieryness)
    buildings = next(item for item in figure.axes[0].collections if isinstance(item, PolyCollection))
    wanted = [np.array(colors.FIERYNESS_RGB[code]) / 255 for code in record.buildings.fieryness.tolist()]
    wanted[-1] = np.array(colors.REFUGE_RGB) / 255
    assert np.allclose(buildings.get_facecolor()[:, :3], wanted)
    corners = buildings.get_paths()[0].vertices
    assert np.allclose(corners[:6], np.column_stack([small.city.outline_x_m[:6], small.city.outline_y_m[:6]]))


def test_the_legend_counts_what_is_there(small):
    record = list(small)[12]
    figure = maps.draw_map(small.city, fieryness=record.buildings.fieryness, brigades_xy=np.array([[1.0, 2.0]] * 3))
    entries = legend_of(figure)
    assert f"inferno ({np.count_nonzero(record.buildings.fieryness == 3)})" in entries
    assert {"refuge (1)", "hydrant (1)", "civilian well (6)", "brigade (3)"} <= set(entries)


def test_people_are_counted_by_the_health_they_have_left(small):
    hp = np.array([1000, 751, 750, 251, 250, 0])
    counts = count_marks(small.city, MapState(fieryness=np.zeros(36, np.uint8), civilian_hp=hp))
    named = {label: n for label, n in counts.items() if label.startswith("civilian")}
    assert named == {"civilian well": 2, "civilian hurt": 2, "civilian dying": 1, "civilian dead": 1}
    assert counts["unburnt"] == 35, "a refuge is none of the buildings that burn"


def test_brigades_are_counted_by_what_they_do(small):
    brigades = BrigadeMarks(
        xy_m=np.zeros((4, 2)), activity=np.array([1, 2, 2, 4]), tank_share=np.ones(4), target=np.array([5, 6, -1, 7])
    )
    state = MapState(fieryness=np.zeros(36, np.uint8), civilian_hp=small.city.civilian_hp, brigades=brigades)
    counts = count_marks(small.city, state)
    assert {label: counts[label] for label in counts if label.startswith("brigade")} == {
        "brigade driving": 1, "brigade spraying": 2, "brigade refilling": 1,
    }  # fmt: skip
    assert (counts["water jet"], counts["way to a target"]) == (1, 1), "refilling brigades go for nothing"
    assert set(counts) <= set(LABELS)


def test_civilians_are_colored_by_health(small):
    hp = np.array([1000, 500, 1, 0, 1000, 1000])
    axes = maps.draw_map(small.city, civilian_hp=hp).axes[0]
    dots = next(item for item in axes.collections if len(item.get_offsets()) == 6)
    assert dots.get_facecolor()[3][:3] == pytest.approx(to_rgba("#0a0a0a")[:3])
    assert dots.get_facecolor()[0][:3] == pytest.approx(np.array(colors.HEALTHY_RGB) / 255)
    shapes = [len(path.vertices) for path in dots.get_paths()]
    assert shapes[3] != shapes[0], "the dead have another shape too"


def test_a_step_shows_jets_ways_and_tanks(small):
    record = list(small)[4]
    record = replace(record, brigades=replace(record.brigades, activity=np.array([1, 2, 4], "u1")))
    recording = MemoryRecording(small.header, small.city, [record])
    axes = maps.draw_steps([recording], [4]).axes[0]
    lines = [item for item in axes.collections if isinstance(item, LineCollection) and item.get_zorder() == 5]
    ends = {tuple(np.round(line.get_segments()[0][1], 6)) for line in lines if len(line.get_segments())}
    aims = {
        (round(float(small.city.center_x_m[k]), 6), round(float(small.city.center_y_m[k]), 6))
        for k in record.decisions.target[:2].tolist()
    }
    assert ends == aims
    gauge, water = (item for item in axes.collections if isinstance(item, PolyCollection) and item.get_zorder() > 6.5)
    full, left = (
        [np.ptp(path.vertices[:, 1]) for path in item.get_paths()] for item in (gauge, water)
    )  # fmt: skip
    assert np.array(left) / np.array(full) == pytest.approx(record.brigades.tank_litres / 15000)


def test_brigades_on_one_spot_stand_side_by_side(small):
    axes = maps.draw_map(small.city, brigades_xy=np.array([[30.0, 30.0]] * 3)).axes[0]
    balls = next(item for item in axes.collections if len(item.get_offsets()) == 3)
    x, y = np.asarray(balls.get_offsets()).T
    assert (y == 30.0).all()
    assert np.diff(x).min() > 0


def test_many_brigades_on_one_spot_stand_in_rows(small):
    axes = maps.draw_map(small.city, brigades_xy=np.array([[30.0, 30.0]] * 20)).axes[0]
    balls = next(item for item in axes.collections if len(item.get_offsets()) == 20)
    x, y = np.asarray(balls.get_offsets()).T
    assert [int((y == height).sum()) for height in sorted(set(y), reverse=True)] == [8, 8, 4]
    assert x[0] == x[8] == x[16] == 30.0


def test_many_brigades_at_the_edge_of_the_map_stay_on_it(small):
    bare = maps.draw_map(small.city).axes[0].get_xlim()
    axes = maps.draw_map(small.city, brigades_xy=np.array([[bare[1] - 1.0, 30.0]] * 20)).axes[0]
    balls = next(item for item in axes.collections if len(item.get_offsets()) == 20)
    x, y = np.asarray(balls.get_offsets()).T
    assert x.max() < bare[1]
    assert len(set(zip(x.tolist(), y.tolist(), strict=True))) == 20
    assert all(text.get_clip_on() for text in axes.texts if text.get_text() == "19")


def test_titles_say_what_when_and_how_well(small):
    figure = maps.draw_steps([small], [12])
    assert texts_of(figure) == [
        "grid, easiest, seed 3",
        f"step 12   score 6.40 of 7   {list(small)[12].score.n_burning} burning, 0 burnt out",
    ]


def test_two_runs_side_by_side_and_one_that_has_ended(small, slower):
    figure = maps.draw_steps([small, slower], [LAST])
    assert len(figure.axes) == 2 + 2, "two maps, and curves below each"
    texts = texts_of(figure)
    assert texts[0] == "A: grid, easiest, seed 3"
    assert texts[2] == "B: grid, nearest-to-me, seed 3"
    assert texts[1].startswith("step 40   score")
    assert texts[3].startswith("step 40 (ended at 30)   score")
    burnt_out = [np.count_nonzero(list(one)[-1].buildings.fieryness[:-1] == 8) for one in (small, slower)]
    assert "burnt out ({} | {})".format(*burnt_out) in legend_of(figure)


def test_a_strip_has_a_map_for_each_step_and_run(small, slower):
    assert len(maps.draw_steps([small], [0, 10, 20, 30, 40, LAST]).axes) == 6
    figure = maps.draw_steps([small, slower], [0, 10, LAST])
    titles = [text for text in texts_of(figure) if ": step" in text]
    assert titles == ["A: step 0", "A: step 10", "A: step 40", "B: step 0", "B: step 10", "B: step 40 (ended at 30)"]
    assert not any("(" in entry for entry in legend_of(figure)), "no counts where there are many maps"


def test_the_part_that_is_drawn_has_all_that_burns_and_who_is_near(small):
    assert fire_extent([small]) is None, "most of the city burns"
    large = make_recording(30, 30, 12)
    part = fire_extent([large])
    assert part is not None
    codes, city = large.column("/buildings", "fieryness"), large.city
    x, y = (np.asarray(one)[codes.any(axis=0)] for one in (city.center_x_m, city.center_y_m))
    assert part.west < x.min() < x.max() < part.east
    assert part.south < y.min() < y.max() < part.north
    whole = whole_extent(city)
    assert part.wide * part.high < 0.6 * whole.wide * whole.high
    assert 0.79 < part.wide / part.high < 1.26
    crew = large.column("/brigades", "x_m"), large.column("/brigades", "y_m")
    near = (np.abs(crew[0] - city.middle_x_m) < 40) & (np.abs(crew[1] - city.middle_y_m) < 40)
    assert near.any()
    assert (crew[0][near] < part.east).all()
    away = [replace(one, brigades=replace(one.brigades, x_m=one.brigades.x_m + 5000)) for one in large]
    assert fire_extent([MemoryRecording(large.header, city, away)]).east < whole.east
    cold = [replace(next(iter(large)), buildings=replace(next(iter(large)).buildings, fieryness=0 * codes[0]))]
    assert fire_extent([MemoryRecording(large.header, city, cold)]) is None


def test_a_part_has_the_whole_city_beside_it_and_curves_with_a_cursor(small):
    large = make_recording(30, 30, 12)
    figure = maps.draw_steps([large], [7])
    city_map, inset, curves = figure.axes
    part = fire_extent([large])
    assert (*city_map.get_xlim(), *city_map.get_ylim()) == pytest.approx(part)
    assert inset.get_xlim() == pytest.approx(whole_extent(large.city)[:2])
    (frame,) = inset.patches
    assert (frame.get_x(), frame.get_y(), frame.get_width()) == pytest.approx((part.west, part.south, part.wide))
    *counts, cursor = curves.lines
    assert [list(line.get_ydata()) for line in counts] == [
        large.column("/score", name).tolist() for name in ("n_burning", "n_burnt_out", "n_water_damaged")
    ]
    assert list(cursor.get_xdata()) == [7, 7]
    assert len(maps.draw_steps([large], [7], whole=True).axes) == 2


def test_a_legend_counts_only_what_there_is(small):
    shown = read_steps_between([small], every=20)
    cells = [maps.cells_of([small], step) for step in shown]
    labels = labels_on(cell for both in cells for cell in both)
    grid = MapGrid(cells[0], labels=labels)
    for one in cells:
        grid.show(one)
        rows = grid.legend_rows
        assert not any("(0)" in row.get_text() for row in rows)
        there = count_marks(small.city, one[0].state)
        assert [row.get_color() != INK for row in rows] == [label not in there for label in labels]


def test_names_are_no_formulas_and_fit(small):
    header = replace(small.header, scenario="$x^2$\n", policy="p" * 300)
    figure = maps.draw_steps([MemoryRecording(header, small.city, list(small))], [3])
    figure.canvas.draw()
    title = figure.texts[0]
    assert title.get_text().startswith("$x^2$\\n, …ppp")
    assert title.get_window_extent().x1 <= figure.bbox.x1


def test_which_steps_are_shown(small, slower):
    assert [shown.step for shown in read_steps_between([small], first=5, last=20, every=4)] == [5, 9, 13, 17, 20]
    assert [shown.step for shown in read_steps([small], [LAST, 3, 3])] == [40, 3, 3]
    assert evenly_spaced([small], 5) == [0, 10, 20, 30, 40]
    assert evenly_spaced([MemoryRecording(small.header, small.city, list(small)[:2])], 5) == [0, 1]
    both = read_steps([small, slower], [35])[0]
    assert [record.step for record in both.records] == [35, 30]
    with pytest.raises(ViewError, match="expected a step from 0 to 40, got 41"):
        read_steps([small], [41])
    with pytest.raises(ViewError, match="recording: expected one with steps"):
        read_steps([MemoryRecording(small.header, small.city, [])], [0])


def simulated(rgb, matrix):
    """CIELAB of a color as somebody without a kind of cones sees it (Machado and others, 2009)."""
    part = np.array(rgb) / 255
    linear = np.clip(matrix @ np.where(part <= 0.04045, part / 12.92, ((part + 0.055) / 1.055) ** 2.4), 0, 1)
    to_xyz = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
    xyz = to_xyz @ linear / np.array([0.9505, 1.0, 1.089])
    f = np.where(xyz > 0.008856, np.cbrt(xyz), 7.787 * xyz + 16 / 116)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


EYES = {
    "all cones": np.eye(3),
    "no red": np.array(
        [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]]
    ),
    "no green": np.array(
        [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]]
    ),
}


@pytest.mark.parametrize("matrix", EYES.values(), ids=EYES)
def test_those_who_do_not_see_red_or_green_can_tell_the_buildings_apart(matrix):
    seen = [simulated(rgb, matrix) for rgb in (*colors.FIERYNESS_RGB, colors.REFUGE_RGB)]
    names = (*FIERYNESS, "refuge")
    apart = {
        (names[a], names[b]): np.linalg.norm(seen[a] - seen[b]) for a in range(len(seen)) for b in range(a)
    }  # fmt: skip
    assert min(apart.values()) > 12.0, min(apart, key=apart.get)


@pytest.mark.parametrize("matrix", EYES.values(), ids=EYES)
def test_those_who_do_not_see_red_or_green_can_tell_runs_and_differences_apart(matrix):
    a, b = (simulated(rgb, matrix) for rgb in colors.RUN_RGB)
    assert np.linalg.norm(a - b) > 60.0
    better, same, worse = (simulated(rgb, matrix) for rgb in colors.DIFFERENCE_RGB)
    assert min(np.linalg.norm(one - other) for one, other in ((better, worse), (better, same), (worse, same))) > 18.0


def test_letters_can_be_read_on_every_ball():
    assert [contrasting(rgb) for rgb in ((225, 225, 225), (40, 140, 255), (10, 10, 10))] == [
        "#333333",
        "white",
        "white",
    ]


def test_the_same_map_gives_the_same_bytes_whatever_the_users_settings(small, tmp_path: Path):
    for ending in ("png", "svg", "pdf"):
        for name, width in (("one", 1.0), ("two", 5.0)):
            with mpl.rc_context({"font.size": 8 * width, "axes.linewidth": width}), plain_style():
                save_figure(maps.draw_steps([small], [7]), tmp_path / f"{name}.{ending}")
        assert (tmp_path / f"one.{ending}").read_bytes() == (tmp_path / f"two.{ending}").read_bytes()
    assert (tmp_path / "one.png").read_bytes().startswith(b"\x89PNG")
    assert b"<svg" in (tmp_path / "one.svg").read_bytes()
    assert (tmp_path / "one.pdf").read_bytes().startswith(b"%PDF")


def test_files_are_not_replaced_unasked_and_never_half_written(small, tmp_path: Path):
    figure = maps.draw_map(small.city)
    path = tmp_path / "map.png"
    path.write_text("mine")
    with pytest.raises(OutputError, match="expected a name that is free, got an existing file; use --force"):
        save_figure(figure, path)
    assert path.read_text() == "mine"
    save_figure(figure, path, force=True)
    assert path.read_bytes().startswith(b"\x89PNG")
    with pytest.raises(OutputError, match="expected an existing folder"):
        save_figure(figure, tmp_path / "nowhere" / "map.png")
    with pytest.raises(OutputError, match=r"expected a file ending in .png, .svg, .pdf, got '.jpg'"):
        save_figure(figure, tmp_path / "map.jpg")
    assert [item.name for item in tmp_path.iterdir()] == ["map.png"]


def test_a_state_has_what_the_record_says(small):
    record = next(iter(small))  # nobody was asked yet: there are no targets
    state = state_of(small.city, record)
    assert state.brigades.target.tolist() == [-1, -1, -1]
    assert state.brigades.tank_share.tolist() == pytest.approx((record.brigades.tank_litres / 15000).tolist())


def test_what_cannot_be_drawn_is_a_line(monkeypatch):
    from fireworld_viewer.pictures import figure_files

    figure = figure_files.new_figure(1, 1)

    def fails(*_, **__):
        raise RuntimeError("raster overflow")

    monkeypatch.setattr(figure, "savefig", fails)
    with pytest.raises(ViewError, match="these values cannot be drawn: RuntimeError: raster overflow"):
        figure_files.png_bytes(figure)


def test_a_ctrl_c_that_becomes_another_error_is_still_one(monkeypatch):
    from fireworld_viewer.pictures import figure_files

    figure = figure_files.new_figure(1, 1)

    def fails(*_, **__):
        try:
            signal.raise_signal(signal.SIGINT)
        except KeyboardInterrupt:
            raise ValueError("Invalid bounding box") from None

    monkeypatch.setattr(figure, "savefig", fails)
    with pytest.raises(KeyboardInterrupt):
        figure_files.png_bytes(figure)


def bottom_of(figure):
    """The lowest edge of the maps, as a part of the figure's height."""
    return min(axes.get_position().y0 for axes in figure.axes)


def test_whom_a_map_is_by_stands_below_it_in_the_corner(small):
    city = replace(small.city, attribution="© Some $mappers$, ODbL 1.0")
    plain, credited = maps.draw_map(small.city), maps.draw_map(city)
    (line,) = [text for text in credited.texts if text.get_text() == city.attribution]
    x, y = line.get_position()
    right = max(axes.get_position().x1 for axes in credited.axes)
    assert x == pytest.approx(right, abs=0.002)
    assert 0 < y < bottom_of(credited)
    assert len(credited.texts) == len(plain.texts) + 1
    long = maps.draw_map(replace(city, attribution="m" * 200))
    (cut,) = [text for text in long.texts if text.get_text().startswith("mmm")]
    assert len(cut.get_text()) < 150
    assert cut.get_text().endswith("…")


def test_strips_and_pairs_name_it_once(small):
    city = replace(small.city, attribution="© mappers")
    recording = MemoryRecording(small.header, city, list(small))
    for recordings in ([recording], [recording, recording]):
        for steps in ([3], [0, 5, LAST]):
            assert texts_of(maps.draw_steps(recordings, steps)).count("© mappers") == 1
