"""Films of recordings, GIF or MP4: the city is drawn once, and what changes is drawn on it frame by frame."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from fireworld.files import written_beside
from fireworld.records import Recording
from fireworld_viewer import colors
from fireworld_viewer.pictures.city_map import GROUND, STREET
from fireworld_viewer.pictures.curves import COUNT_STYLES
from fireworld_viewer.pictures.extent import fire_extent
from fireworld_viewer.pictures.figure_files import INK, PAPER, import_library
from fireworld_viewer.pictures.frames import DPI, MAP_INCHES, Frame, GridFrames
from fireworld_viewer.pictures.map_grid import MapGrid, labels_on
from fireworld_viewer.pictures.maps import cells_of
from fireworld_viewer.story.steps import ShownStep

if TYPE_CHECKING:
    from PIL.Image import Image

FPS: Final = 10.0
_PAIR_INCHES: Final = 4.6
_HOLD_SECONDS: Final = 2.0  # how long the last frame stays
_TRANSPARENT: Final = 255
"""Number of the color that shows the frame before; it comes after all others."""
_NEAR: Final = 6
_NO_AV: Final = (
    "film: PyAV, which writes .mp4, is not installed; try pip install 'fireworld[film]', or a film that ends in .gif"
)


def save_film(
    recordings: Sequence[Recording],
    steps: Sequence[ShownStep],
    path: Path,
    *,
    fps: float = FPS,
    whole: bool = False,
    on_frame: Callable[[], object] = lambda: None,
) -> None:
    """Write a film, of the kind that the file's ending names; nothing is left of it after an error or Ctrl-C.

    Args:
        recordings: one, or two of the same city.
        steps: one for each frame, from `story.steps.read_steps_between`.
        path: the file; one that exists is replaced.
        fps: frames a second.
        whole: show the whole city, not only where it burns.
        on_frame: called after each frame.

    Raises:
        OutputError: the file cannot be written.
        ViewError: matplotlib, or for MP4 PyAV, is not installed.
    """
    write = FILMS[path.suffix.lower()]
    if write is _write_mp4:
        import_library("av", _NO_AV)
    frames = FilmFrames(recordings, steps, whole=whole)
    with written_beside(path) as partial:
        write(frames, partial, fps, on_frame)


class FilmFrames:
    """The frames of a film, drawn when asked for; the city is drawn once. Arguments as in `save_film`."""

    def __init__(self, recordings: Sequence[Recording], steps: Sequence[ShownStep], *, whole: bool = False) -> None:
        self._recordings, self._steps = recordings, steps
        self._part = None if whole else fire_extent(recordings)
        inches = MAP_INCHES if len(recordings) == 1 else _PAIR_INCHES
        labels = labels_on(cell for step in steps for cell in cells_of(recordings, step))
        first = cells_of(recordings, steps[0], part=self._part)
        grid = MapGrid(first, columns=len(recordings), map_inches=inches, labels=labels, curves=recordings, dpi=DPI)
        self._frames = GridFrames(grid)

    def __len__(self) -> int:
        return len(self._steps)

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels, both even."""
        return self._frames.size

    def frame(self, index: int) -> Frame:
        """Draw a frame."""
        return self._frames.draw(cells_of(self._recordings, self._steps[index], part=self._part))


def _write_gif(frames: FilmFrames, path: Path, fps: float, on_frame: Callable[[], object]) -> None:
    """Write a GIF: one palette for all frames, and of each frame what has changed."""
    samples = [frames.frame(place) for place in sorted({round(k * (len(frames) - 1) / 2) for k in range(3)})]
    pictures = _differences(frames, _palette(samples), on_frame)
    durations = [round(1000.0 / fps)] * (len(frames) - 1) + [round(1000.0 * _HOLD_SECONDS)]
    with path.open("wb") as file:
        next(pictures).save(
            file, format="GIF", save_all=True, append_images=pictures, duration=durations, loop=0, disposal=1,
            optimize=False,
        )  # fmt: skip


def _differences(frames: FilmFrames, palette: Image, on_frame: Callable[[], object]) -> Iterator[Image]:
    """Yield the frames in the colors of a palette; what is the same as in the frame before is transparent."""
    from PIL import Image

    table = np.zeros((256, 3), dtype=np.uint8)  # all of it, so that the last number is in the file, too
    own = np.array(palette.getpalette(), dtype=np.uint8).reshape(-1, 3)
    table[: len(own)] = own
    before: NDArray[np.uint8] | None = None
    for index in range(len(frames)):
        now = np.asarray(Image.fromarray(frames.frame(index)).quantize(palette=palette, dither=Image.Dither.NONE))
        picture = Image.fromarray(now if before is None else np.where(now == before, np.uint8(_TRANSPARENT), now))
        picture.putpalette(table.tobytes())
        picture.info["transparency"] = _TRANSPARENT
        yield picture
        on_frame()
        before = now


def _palette(samples: Sequence[Frame]) -> Image:
    """Return a picture whose palette has every color of the table, and the most useful others of some frames."""
    from PIL import Image, ImageColor

    drawn = [color for color, _ in COUNT_STYLES.values()]
    exact = [
        *colors.FIERYNESS_RGB,
        *colors.ACTIVITY_RGB,
        *colors.HEALTH_RGB,
        colors.REFUGE_RGB,
        colors.WATER_RGB,
        colors.HYDRANT_RGB,
    ]
    exact += [ImageColor.getrgb(color)[:3] for color in (PAPER, GROUND, STREET, INK, *drawn)]
    n = _TRANSPARENT - len(exact)
    mixed = Image.fromarray(np.concatenate(samples)).quantize(n, method=Image.Quantize.MEDIANCUT)
    others = np.array(mixed.getpalette(), dtype=np.int64).reshape(-1, 3)[:n]
    # Pillow takes a color for another that is very near: none may be very near to an exact one.
    apart = np.abs(others[:, np.newaxis] - np.array(exact)).max(axis=2).min(axis=1) > _NEAR
    palette = Image.new("P", (1, 1))
    palette.putpalette([*np.array(exact).ravel().tolist(), *others[apart].ravel().tolist()])
    return palette


def _write_mp4(frames: FilmFrames, path: Path, fps: float, on_frame: Callable[[], object]) -> None:
    """Write H.264 that every browser plays; one thread, so that the bytes are the same on every machine."""
    av = import_library("av", _NO_AV)
    options = {"crf": "20", "preset": "veryfast", "threads": "1"}
    with av.open(str(path), mode="w", format="mp4", options={"movflags": "+faststart"}) as film:
        stream = film.add_stream("libx264", rate=Fraction(fps).limit_denominator(1000), options=options)
        stream.width, stream.height, stream.pix_fmt = *frames.size, "yuv420p"
        for index in range(len(frames) + round(_HOLD_SECONDS * fps) - 1):
            if index < len(frames):
                frame = frames.frame(index)
                on_frame()
            film.mux(stream.encode(av.VideoFrame.from_ndarray(frame, format="rgb24")))
        film.mux(stream.encode(None))


FILMS: Final[Mapping[str, Callable[[FilmFrames, Path, float, Callable[[], object]], None]]] = {
    ".gif": _write_gif,
    ".mp4": _write_mp4,
}
"""Endings of films, and the functions that write them."""
