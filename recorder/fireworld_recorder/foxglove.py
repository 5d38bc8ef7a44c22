"""Encode what Foxglove, Lichtblick and Rerun draw without a plugin: point clouds, scenes of shapes, and lines of a log.

Shapes that occur by the thousand are arrays of rows of one layout, with every field written, zeros too: a few copies
make a message.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from fireworld.records import STEP_SECONDS
from fireworld_recorder.codec import parts, walk
from fireworld_recorder.schema import Channel, varint

FRAME: Final = "city"
"""The one frame of reference: metres east, north and up, as the city has them."""
Rgb = tuple[int, int, int]
DESCRIPTORS: Final = {
    root: Path(__file__).with_name(f"foxglove_{root}.binpb").read_bytes()
    for root in ("PointCloud", "SceneUpdate", "Log")
}
"""Foxglove's published schema of each message that a topic can have: a FileDescriptorSet with all that is in it."""
_FIELDS: Final = {
    str(next(parts(message, 1)), "utf-8"): {
        str(field[1], "utf-8"): (field[3], field[5])
        for field in ({number: value for number, _, value in walk(part)} for part in parts(message, 2))
    }
    for data in DESCRIPTORS.values()
    for file in parts(data, 1)
    for message in parts(file, 4)
}
"""Number and type, as descriptor.proto numbers it, of every field of every message."""
_LAYOUTS: Final = {1: ("<d", 1), 7: ("<I", 5)}
"""Layout and wire type of the numbers of fixed length, double and fixed32."""
_NUMERIC_TYPES: Final = {"u1": 1, "i4": 6, "u4": 5, "f4": 7, "f8": 8}
_LINE_LIST: Final = 2
_LEVELS: Final = {"DEBUG": 1, "INFO": 2, "WARNING": 3, "ERROR": 4, "FATAL": 5}


def channel(topic: str, root: str) -> Channel:
    """A topic of one of Foxglove's messages."""
    return Channel(topic, f"foxglove.{root}", DESCRIPTORS[root])


def point_cloud(step: int, points: NDArray[Any]) -> bytes:
    """Encode points; the names and types of the structured array are those of the fields.

    Args:
        step: of the run.
        points: (n,) structured, packed: x, y, z; red, green, blue, alpha for the color; whatever else.
    """
    layout = points.dtype
    places: Mapping[str, Any] = layout.fields or {}
    fields = [
        _part("PointCloud", "fields", _packed_field(name, places[name][0].str[1:], places[name][1]))
        for name in layout.names or ()
    ]
    stride = _value("PointCloud", "point_stride", layout.itemsize)
    head = _stamp(step) + _part("PointCloud", "frame_id", FRAME) + _part("PointCloud", "pose", _pose())
    return head + stride + b"".join(fields) + _part("PointCloud", "data", points.tobytes())


def scene(entities: Sequence[bytes]) -> bytes:
    """Encode a scene update: entities that replace those of the same ids."""
    return b"".join(_part("SceneUpdate", "entities", entity) for entity in entities)


def entity(step: int, name: str, *shapes: bytes) -> bytes:
    """Encode an entity of shapes; it stays until another of that name comes."""
    return _stamp(step) + _part("SceneEntity", "frame_id", FRAME) + _part("SceneEntity", "id", name) + b"".join(shapes)


def spheres(xyz_m: NDArray[Any], rgb: NDArray[Any], *, diameter_m: float) -> bytes:
    """Encode balls. (n, 3) centers, (n, 3) colors 0..255."""
    upright = _part("Pose", "orientation", _value("Quaternion", "w", 1.0))
    size = _of_doubles("Vector3", np.full(3, diameter_m).tobytes())
    pose = _wrapped("SpherePrimitive", "pose", [*_wrapped("Pose", "position", _doubles("Vector3")), upright])
    color = _wrapped("SpherePrimitive", "color", _doubles("Color"))
    row = _Row(_wrapped("SceneEntity", "spheres", [*pose, _part("SpherePrimitive", "size", size), *color]))
    return row.filled({**_columns(xyz_m, "xyz"), **_columns(np.asarray(rgb) / 255, "rgb"), "a": 1.0}, len(xyz_m))


def lines(segments_m: NDArray[Any], rgb: Rgb, *, thickness_m: float) -> bytes:
    """Encode separate lines of one color, (n, 2, 3) ends; nothing if there are none."""
    if len(segments_m) == 0:
        return b""
    kind = varint(_tag("LinePrimitive", "type", 0)) + varint(_LINE_LIST)
    content = kind + _part("LinePrimitive", "pose", _pose()) + _value("LinePrimitive", "thickness", thickness_m)
    content += _points("LinePrimitive", segments_m.reshape(-1, 3)) + _part("LinePrimitive", "color", _color(rgb))
    return _part("SceneEntity", "lines", content)


def triangles(xyz_m: NDArray[Any], indices: NDArray[Any], rgb: Rgb) -> bytes:
    """Encode triangles of one color: (v, 3) corners, (t, 3) indices of corners; nothing if there are none."""
    if len(indices) == 0:
        return b""
    content = _part("TriangleListPrimitive", "pose", _pose()) + _points("TriangleListPrimitive", xyz_m)
    content += _part("TriangleListPrimitive", "color", _color(rgb))
    content += _part("TriangleListPrimitive", "indices", np.ascontiguousarray(indices, dtype="<u4").tobytes())
    return _part("SceneEntity", "triangles", content)


def label(xyz_m: Sequence[float], text: str, *, height_m: float, rgb: Rgb) -> bytes:
    """Encode a text that faces the eye."""
    content = _part("TextPrimitive", "pose", _pose(xyz_m)) + varint(_tag("TextPrimitive", "billboard", 0)) + b"\x01"
    content += _value("TextPrimitive", "font_size", height_m)
    content += _part("TextPrimitive", "color", _color(rgb)) + _part("TextPrimitive", "text", text)
    return _part("SceneEntity", "texts", content)


def log_line(step: int, *, level: str, text: str, name: str) -> bytes:
    """Encode a line of a log; `level` is one of Log.Level."""
    number = varint(_tag("Log", "level", 0)) + varint(_LEVELS[level])
    return _stamp(step) + number + _part("Log", "message", text) + _part("Log", "name", name)


def _stamp(step: int) -> bytes:
    """Field 1 of every message that has a time: a Timestamp of whole seconds."""
    return _length_delimited(1, b"\x08" + varint(step * STEP_SECONDS) if step else b"")


def _pose(xyz_m: Sequence[float] = (0.0, 0.0, 0.0)) -> bytes:
    position = _of_doubles("Vector3", np.asarray(xyz_m, dtype="<f8").tobytes())
    return _part("Pose", "position", position) + _part("Pose", "orientation", _value("Quaternion", "w", 1.0))


def _color(rgb: Rgb) -> bytes:
    return _of_doubles("Color", np.array([*(part / 255 for part in rgb), 1.0], dtype="<f8").tobytes())


def _points(message: str, xyz_m: NDArray[Any]) -> bytes:
    return _Row(_wrapped(message, "points", _doubles("Point3"))).filled(_columns(xyz_m, "xyz"), len(xyz_m))


def _columns(table: NDArray[Any], names: str) -> dict[str, Any]:
    return {name: table[:, place] for place, name in enumerate(names)}


def _packed_field(name: str, kind: str, offset: int) -> bytes:
    type_ = varint(_tag("PackedElementField", "type", 0)) + varint(_NUMERIC_TYPES[kind])
    return _part("PackedElementField", "name", name) + _value("PackedElementField", "offset", offset) + type_


def _tag(message: str, field: str, wire_type: int) -> int:
    number: int = _FIELDS[message][field][0]
    return number << 3 | wire_type


def _part(message: str, field: str, data: bytes | str) -> bytes:
    return _length_delimited(_FIELDS[message][field][0], data)


def _length_delimited(number: int, data: bytes | str) -> bytes:
    content = data.encode() if isinstance(data, str) else data
    return b"%b%b%b" % (varint(number << 3 | 2), varint(len(content)), content)


def _value(message: str, field: str, value: float) -> bytes:
    """Encode a double or a fixed32, whichever the field is."""
    layout, wire_type = _LAYOUTS[_FIELDS[message][field][1]]
    return varint(_tag(message, field, wire_type)) + struct.pack(layout, value)


def _of_doubles(message: str, data: bytes) -> bytes:
    """Encode a message of doubles only, all of them."""
    tags = [varint(_tag(message, name, 1)) for name in _FIELDS[message]]
    return b"".join(tag + data[8 * place : 8 * place + 8] for place, tag in enumerate(tags))


Parts = Sequence[bytes | str]
"""Of a row: bytes that are always the same, and names of doubles."""


def _doubles(message: str) -> Parts:
    """Parts of a message of doubles only."""
    return [part for name in _FIELDS[message] for part in (varint(_tag(message, name, 1)), name)]


def _wrapped(message: str, field: str, parts: Parts) -> Parts:
    """Parts of a field that holds a message of the parts given."""
    length = sum(8 if isinstance(part, str) else len(part) for part in parts)
    return [varint(_tag(message, field, 2)) + varint(length), *parts]


class _Row:
    """The layout of a row."""

    def __init__(self, parts: Parts) -> None:
        names = [part if isinstance(part, str) else f"_{place}" for place, part in enumerate(parts)]
        kinds = ["<f8" if isinstance(part, str) else f"V{len(part)}" for part in parts]
        self._dtype = np.dtype(list(zip(names, kinds, strict=True)))
        self._template = b"".join(bytes(8) if isinstance(part, str) else part for part in parts)

    def filled(self, columns: Mapping[str, Any], n: int) -> bytes:
        """Return n rows with these doubles."""
        rows = np.frombuffer(bytearray(self._template * n), dtype=self._dtype)
        for name, values in columns.items():
            rows[name] = values
        return rows.tobytes()
