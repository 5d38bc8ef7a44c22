"""Still maps: the colors of the table, what is on the map, and the same bytes every time."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgba

from fireworld.errors import OutputError
from viewer import colors, maps


def test_buildings_have_the_colors_of_their_codes(small):
    record = list(small)[12]
    figure = maps.draw_map(small.city, fieryness=record.buildings.fieryness)
    (buildings,) = [item for item in figure.axes[0].collections if isinstance(item, PolyCollection)]
    wanted = [np.array(colors.FIERYNESS_RGB[code]) / 255 for code in record.buildings.fieryness.tolist()]
    wanted[-1] = np.array(colors.REFUGE_RGB) / 255
    assert np.allclose(buildings.get_facecolor()[:, :3], wanted)
    corners = buildings.get_paths()[0].vertices
    assert np.allclose(corners[:6], np.column_stack([small.city.outline_x_m[:6], small.city.outline_y_m[:6]]))


def test_the_legend_counts_what_is_there(small):
    record = list(small)[12]
    figure = maps.draw_map(small.city, fieryness=record.buildings.fieryness, brigades_xy=np.array([[1.0, 2.0]] * 3))
    entries = [text.get_text() for text in figure.axes[0].get_legend().get_texts()]
    assert f"inferno ({np.count_nonzero(record.buildings.fieryness == 3)})" in entries
    assert {"refuge (1)", "hydrant (1)", "civilian (6)", "brigade (3)"} <= set(entries)


def test_civilians_are_colored_by_health(small):
    hp = np.array([1000, 500, 1, 0, 1000, 1000])
    axes = maps.draw_map(small.city, civilian_hp=hp).axes[0]
    dots = next(item for item in axes.collections if len(item.get_offsets()) == 6)
    assert dots.get_facecolor()[3][:3] == pytest.approx(to_rgba("#0a0a0a")[:3])
    assert dots.get_facecolor()[0][:3] == pytest.approx(np.array(colors.HEALTHY_RGB) / 255)


def test_the_same_map_gives_the_same_bytes(small, tmp_path: Path):
    for name in ("one.png", "two.png"):
        maps.save_figure(maps.draw_map(small.city), tmp_path / name)
    first = (tmp_path / "one.png").read_bytes()
    assert first == (tmp_path / "two.png").read_bytes()
    assert first.startswith(b"\x89PNG")


def test_files_are_not_replaced_unasked_and_never_half_written(small, tmp_path: Path):
    figure = maps.draw_map(small.city)
    path = tmp_path / "map.png"
    path.write_text("mine")
    with pytest.raises(OutputError, match="exists already; try --force"):
        maps.save_figure(figure, path)
    assert path.read_text() == "mine"
    maps.save_figure(figure, path, force=True)
    assert path.read_bytes().startswith(b"\x89PNG")
    with pytest.raises(OutputError, match="cannot be written: No such file"):
        maps.save_figure(figure, tmp_path / "nowhere" / "map.png")
    assert [item.name for item in tmp_path.iterdir()] == ["map.png"]
