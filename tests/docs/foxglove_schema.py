"""The schemas of a scene's topics: names and numbers of Foxglove's published messages, and their descriptors.

Names and numbers are those of the `foxglove` protobuf package; all fields are declared, also those that a scene never
writes, because a panel may look for them. `python -m tests.docs.foxglove_schema` renews the descriptors beside
`fireworld_recorder.foxglove`, so that recording needs no protobuf library.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Final, NamedTuple

from fireworld_recorder import foxglove
from fireworld_recorder.schema import varint

TIMESTAMP: Final = "google.protobuf.Timestamp"
DURATION: Final = "google.protobuf.Duration"
_PACKAGE: Final = "foxglove"
_SCALARS: Final[Mapping[str, int]] = {
    "double": 1, "int64": 3, "int32": 5, "fixed32": 7, "bool": 8, "string": 9, "bytes": 12,
}  # fmt: skip
"""Numbers of protobuf's types in descriptor.proto."""
_MESSAGE, _ENUM, _OPTIONAL, _REPEATED = 11, 14, 1, 3


class Item(NamedTuple):
    """A field: its number, name and type; a type that is no scalar is an enumeration or a message."""

    number: int
    name: str
    type: str
    repeated: bool = False


MESSAGES: Final[Mapping[str, tuple[Item, ...]]] = {
    "PointCloud": (
        Item(1, "timestamp", TIMESTAMP),
        Item(2, "frame_id", "string"),
        Item(3, "pose", "Pose"),
        Item(4, "point_stride", "fixed32"),
        Item(5, "fields", "PackedElementField", repeated=True),
        Item(6, "data", "bytes"),
    ),
    "PackedElementField": (
        Item(1, "name", "string"),
        Item(2, "offset", "fixed32"),
        Item(3, "type", "PackedElementField.NumericType"),
    ),
    "SceneUpdate": (
        Item(1, "deletions", "SceneEntityDeletion", repeated=True),
        Item(2, "entities", "SceneEntity", repeated=True),
    ),
    "SceneEntityDeletion": (
        Item(1, "timestamp", TIMESTAMP),
        Item(2, "type", "SceneEntityDeletion.Type"),
        Item(3, "id", "string"),
    ),
    "SceneEntity": (
        Item(1, "timestamp", TIMESTAMP),
        Item(2, "frame_id", "string"),
        Item(3, "id", "string"),
        Item(4, "lifetime", DURATION),
        Item(5, "frame_locked", "bool"),
        Item(6, "metadata", "KeyValuePair", repeated=True),
        Item(7, "arrows", "ArrowPrimitive", repeated=True),
        Item(8, "cubes", "CubePrimitive", repeated=True),
        Item(9, "spheres", "SpherePrimitive", repeated=True),
        Item(10, "cylinders", "CylinderPrimitive", repeated=True),
        Item(11, "lines", "LinePrimitive", repeated=True),
        Item(12, "triangles", "TriangleListPrimitive", repeated=True),
        Item(13, "texts", "TextPrimitive", repeated=True),
        Item(14, "models", "ModelPrimitive", repeated=True),
    ),
    "KeyValuePair": (Item(1, "key", "string"), Item(2, "value", "string")),
    "ArrowPrimitive": (
        Item(1, "pose", "Pose"),
        Item(2, "shaft_length", "double"),
        Item(3, "shaft_diameter", "double"),
        Item(4, "head_length", "double"),
        Item(5, "head_diameter", "double"),
        Item(6, "color", "Color"),
    ),
    "CubePrimitive": (Item(1, "pose", "Pose"), Item(2, "size", "Vector3"), Item(3, "color", "Color")),
    "CylinderPrimitive": (
        Item(1, "pose", "Pose"),
        Item(2, "size", "Vector3"),
        Item(3, "bottom_scale", "double"),
        Item(4, "top_scale", "double"),
        Item(5, "color", "Color"),
    ),
    "ModelPrimitive": (
        Item(1, "pose", "Pose"),
        Item(2, "scale", "Vector3"),
        Item(3, "color", "Color"),
        Item(4, "override_color", "bool"),
        Item(5, "url", "string"),
        Item(6, "media_type", "string"),
        Item(7, "data", "bytes"),
    ),
    "SpherePrimitive": (Item(1, "pose", "Pose"), Item(2, "size", "Vector3"), Item(3, "color", "Color")),
    "LinePrimitive": (
        Item(1, "type", "LinePrimitive.Type"),
        Item(2, "pose", "Pose"),
        Item(3, "thickness", "double"),
        Item(4, "scale_invariant", "bool"),
        Item(5, "points", "Point3", repeated=True),
        Item(6, "color", "Color"),
        Item(7, "colors", "Color", repeated=True),
        Item(8, "indices", "fixed32", repeated=True),
    ),
    "TriangleListPrimitive": (
        Item(1, "pose", "Pose"),
        Item(2, "points", "Point3", repeated=True),
        Item(3, "color", "Color"),
        Item(4, "colors", "Color", repeated=True),
        Item(5, "indices", "fixed32", repeated=True),
    ),
    "TextPrimitive": (
        Item(1, "pose", "Pose"),
        Item(2, "billboard", "bool"),
        Item(3, "font_size", "double"),
        Item(4, "scale_invariant", "bool"),
        Item(5, "color", "Color"),
        Item(6, "text", "string"),
    ),
    "Log": (
        Item(1, "timestamp", TIMESTAMP),
        Item(2, "level", "Log.Level"),
        Item(3, "message", "string"),
        Item(4, "name", "string"),
        Item(5, "file", "string"),
        Item(6, "line", "fixed32"),
    ),
    "Pose": (Item(1, "position", "Vector3"), Item(2, "orientation", "Quaternion")),
    "Vector3": (Item(1, "x", "double"), Item(2, "y", "double"), Item(3, "z", "double")),
    "Point3": (Item(1, "x", "double"), Item(2, "y", "double"), Item(3, "z", "double")),
    "Quaternion": (Item(1, "x", "double"), Item(2, "y", "double"), Item(3, "z", "double"), Item(4, "w", "double")),
    "Color": (Item(1, "r", "double"), Item(2, "g", "double"), Item(3, "b", "double"), Item(4, "a", "double")),
}

ENUMERATIONS: Final[Mapping[str, Mapping[str, int]]] = {
    "PackedElementField.NumericType": {
        "UNKNOWN": 0, "UINT8": 1, "INT8": 2, "UINT16": 3, "INT16": 4, "UINT32": 5, "INT32": 6,
        "FLOAT32": 7, "FLOAT64": 8,
    },
    "SceneEntityDeletion.Type": {"MATCHING_ID": 0, "ALL": 1},
    "LinePrimitive.Type": {"LINE_STRIP": 0, "LINE_LOOP": 1, "LINE_LIST": 2},
    "Log.Level": {"UNKNOWN": 0, "DEBUG": 1, "INFO": 2, "WARNING": 3, "ERROR": 4, "FATAL": 5},
}  # fmt: skip


def descriptor_set(root: str) -> bytes:
    """Encode a FileDescriptorSet of a message and of all that it is made of."""
    names = _reachable(root)
    google = {
        full_name: f"google/protobuf/{short.lower()}.proto"
        for full_name, short in ((TIMESTAMP, "Timestamp"), (DURATION, "Duration"))
        if any(item.type == full_name for name in names for item in MESSAGES[name])
    }
    time = (Item(1, "seconds", "int64"), Item(2, "nanos", "int32"))
    files = [
        _file(path, "google.protobuf", (), [_descriptor(full_name.rpartition(".")[2], time)])
        for full_name, path in google.items()
    ]
    messages = [_descriptor(name, MESSAGES[name]) for name in names]
    files.append(_file(f"{_PACKAGE}/{root}.proto", _PACKAGE, tuple(google.values()), messages))
    return b"".join(length_delimited(1, file) for file in files)


def length_delimited(number: int, data: bytes | str) -> bytes:
    """Encode a field that follows its length: a text, bytes or a message."""
    content = data.encode() if isinstance(data, str) else data
    return b"%b%b%b" % (varint(number << 3 | 2), varint(len(content)), content)


def _number(number: int, value: int) -> bytes:
    return varint(number << 3) + varint(value)


def _reachable(root: str) -> list[str]:
    """Name a message and those inside it, each once, the message first."""
    found = [root]
    for name in found:  # it grows while it is read
        found.extend(item.type for item in MESSAGES[name] if item.type in MESSAGES and item.type not in found)
    return found


def _file(name: str, package: str, dependencies: tuple[str, ...], messages: list[bytes]) -> bytes:
    """FileDescriptorProto: name = 1, package = 2, dependency = 3, message_type = 4, syntax = 12."""
    parts = [length_delimited(1, name), length_delimited(2, package)]
    parts += [length_delimited(3, dependency) for dependency in dependencies]
    parts += [length_delimited(4, message) for message in messages]
    return b"".join(parts) + length_delimited(12, "proto3")


def _descriptor(name: str, items: tuple[Item, ...]) -> bytes:
    """DescriptorProto: name = 1, field = 2, enum_type = 4."""
    enumerations = [length_delimited(4, part) for part in _enumerations(name)]
    return (
        length_delimited(1, name)
        + b"".join(length_delimited(2, _field(item)) for item in items)
        + b"".join(enumerations)
    )


def _field(item: Item) -> bytes:
    """FieldDescriptorProto: name = 1, number = 3, label = 4, type = 5, type_name = 6."""
    kind = _SCALARS.get(item.type) or (_ENUM if item.type in ENUMERATIONS else _MESSAGE)
    data = length_delimited(1, item.name) + _number(3, item.number)
    data += _number(4, _REPEATED if item.repeated else _OPTIONAL) + _number(5, kind)
    if item.type in _SCALARS:
        return data
    known = item.type in MESSAGES or item.type in ENUMERATIONS
    return data + length_delimited(6, f".{_PACKAGE}.{item.type}" if known else f".{item.type}")


def _enumerations(name: str) -> Iterator[bytes]:
    """EnumDescriptorProto: name = 1, value = 2, and in it name = 1, number = 2."""
    for full_name, values in ENUMERATIONS.items():
        owner, _, own_name = full_name.partition(".")
        if owner == name:
            entries = [
                length_delimited(2, length_delimited(1, key) + _number(2, value)) for key, value in values.items()
            ]
            yield length_delimited(1, own_name) + b"".join(entries)


if __name__ == "__main__":
    folder = Path(foxglove.__file__).parent
    for root in foxglove.DESCRIPTORS:
        (folder / f"foxglove_{root}.binpb").write_bytes(descriptor_set(root))
