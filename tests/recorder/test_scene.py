"""Scenes for Foxglove: the published messages, what they show, and a digest that does not know of them."""

from __future__ import annotations

import json

import numpy as np
import pytest
from fireworld_recorder import foxglove
from fireworld_recorder.reader import open_log
from fireworld_viewer import colors
from fireworld_viewer.city_mesh import STOREY_M
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

from fireworld.recording.pages.foxglove_scene import CITY, FIRE, LOG, POINTS, TEAM
from tests.docs import foxglove_schema
from tests.viewer.rrd import rerun_program

RUN = ("run", "quick", "--steps", 12, "--policy", "easiest", "--json")

PUBLISHED = {
    "PointCloud": "timestamp frame_id pose point_stride fields data",
    "PackedElementField": "name offset type",
    "SceneUpdate": "deletions entities",
    "SceneEntityDeletion": "timestamp type id",
    "SceneEntity": "timestamp frame_id id lifetime frame_locked metadata arrows cubes spheres cylinders lines triangles"
    " texts models",
    "KeyValuePair": "key value",
    "ArrowPrimitive": "pose shaft_length shaft_diameter head_length head_diameter color",
    "CubePrimitive": "pose size color",
    "SpherePrimitive": "pose size color",
    "CylinderPrimitive": "pose size bottom_scale top_scale color",
    "LinePrimitive": "type pose thickness scale_invariant points color colors indices",
    "TriangleListPrimitive": "pose points color colors indices",
    "TextPrimitive": "pose billboard font_size scale_invariant color text",
    "ModelPrimitive": "pose scale color override_color url media_type data",
    "Log": "timestamp level message name file line",
    "Pose": "position orientation",
    "Vector3": "x y z",
    "Point3": "x y z",
    "Quaternion": "x y z w",
    "Color": "r g b a",
}
"""Fields of the published .proto files by number, from 1; later numbers (100 and 101: identifiers) are left out."""
TYPES = {
    "double": "shaft_length shaft_diameter head_length head_diameter bottom_scale top_scale thickness font_size"
    " x y z w r g b a",
    "string": "frame_id id name message file text url media_type key value",
    "fixed32": "point_stride offset line indices",
    "bytes": "data",
    "bool": "frame_locked scale_invariant billboard override_color",
    "google.protobuf.Timestamp": "timestamp",
    "google.protobuf.Duration": "lifetime",
    "Color": "color colors",
    "Pose": "pose",
    "Point3": "points",
    "Vector3": "position size scale",
    "Quaternion": "orientation",
}
REPEATED = (
    "fields deletions entities metadata arrows cubes spheres cylinders lines triangles texts models"
    " points colors indices"
)
MESSAGE_LISTS = {
    "fields": "PackedElementField",
    "deletions": "SceneEntityDeletion",
    "entities": "SceneEntity",
    "metadata": "KeyValuePair",
    **{
        f"{kind.lower()}s": f"{kind}Primitive"
        for kind in ("Arrow", "Cube", "Sphere", "Cylinder", "Line", "Text", "Model")
    },
    "triangles": "TriangleListPrimitive",
}
ENUMERATIONS = {
    "PackedElementField.NumericType": "UNKNOWN UINT8 INT8 UINT16 INT16 UINT32 INT32 FLOAT32 FLOAT64",
    "SceneEntityDeletion.Type": "MATCHING_ID ALL",
    "LinePrimitive.Type": "LINE_STRIP LINE_LOOP LINE_LIST",
    "Log.Level": "UNKNOWN DEBUG INFO WARNING ERROR FATAL",
}


@pytest.fixture
def log(here, fireworld):
    assert fireworld(*RUN, "--record", "a.mcap", "--scene", "foxglove").code == 0
    return open_log("a.mcap")


def messages_of(log, topic):
    """The messages of a topic, step by step, decoded by the protobuf library with the schema in the log."""
    channel = next(one for one in log.found.channels.values() if one.topic == topic)
    described = log.found.schemas[channel.schema_id]
    pool = descriptor_pool.DescriptorPool()
    for file in descriptor_pb2.FileDescriptorSet.FromString(described.data).file:
        pool.Add(file)
    message = message_factory.GetMessageClass(pool.FindMessageTypeByName(described.name))
    steps = [[message.FromString(bytes(data)) for found, data in raw if found == topic] for raw in log.raw_steps()]
    for step, found in enumerate(steps):
        for one in found:
            stamped = list(one.entities) if topic in {CITY, FIRE, TEAM} else [one]
            assert {item.timestamp.seconds for item in stamped} == {60 * step}
            assert all(item.frame_id == "city" for item in stamped if topic != LOG)
            declared = type(one).FromString(one.SerializeToString())
            declared.DiscardUnknownFields()
            assert declared.ByteSize() == one.ByteSize()  # all that is written is in the schema, by number and type
    return steps


def rgb_of(color):
    assert color.a == 1.0
    return tuple(round(255 * part) for part in (color.r, color.g, color.b))


FILES = [
    file
    for data in foxglove.DESCRIPTORS.values()
    for file in descriptor_pb2.FileDescriptorSet.FromString(data).file
    if file.package == "foxglove"
]


def type_of(item):
    """Name of a field's type, as in TYPES."""
    scalar = descriptor_pb2.FieldDescriptorProto.Type.Name(item.type).removeprefix("TYPE_").lower()
    return item.type_name.removeprefix(".").removeprefix("foxglove.") or scalar


@pytest.mark.parametrize("name", PUBLISHED)
def test_fields_have_the_published_numbers_and_types(name):
    (first, *others) = [message for file in FILES for message in file.message_type if message.name == name]
    assert all(other == first for other in others)
    fields = {item.number: item for item in first.field}
    assert {number: item.name for number, item in fields.items()} == dict(enumerate(PUBLISHED[name].split(), start=1))
    for item in fields.values():
        assert (item.label == item.LABEL_REPEATED) == (item.name in REPEATED.split())
        wanted = [kind for kind, names in TYPES.items() if item.name in names.split()]
        if item.name in MESSAGE_LISTS:
            wanted = [MESSAGE_LISTS[item.name]]
        elif item.name in {"type", "level"}:
            wanted = [kind for kind in ENUMERATIONS if kind.startswith(f"{name}.")]
        assert [type_of(item)] == wanted


def test_numbers_of_enumerations_are_the_published_ones():
    messages = {message.name: message for file in FILES for message in file.message_type}
    found = {f"{name}.{kind.name}": kind for name, message in messages.items() for kind in message.enum_type}
    for name, words in ENUMERATIONS.items():
        numbers = [(value.name, value.number) for value in found[name].value]
        assert numbers == [(word, k) for k, word in enumerate(words.split())]
    assert set(found) == set(ENUMERATIONS)
    assert set(messages) == set(PUBLISHED)


@pytest.mark.parametrize("root", foxglove.DESCRIPTORS)
def test_checked_in_descriptors_are_current(root):
    assert foxglove.DESCRIPTORS[root] == foxglove_schema.descriptor_set(root), "run `make docs`"


def test_points_are_the_buildings_at_every_step(log):
    sizes = {1: ("u1", 1), 6: ("<i4", 4), 7: ("<f4", 4)}
    refuges = set(log.city.refuge_building.tolist())
    clouds = messages_of(log, POINTS)
    assert [len(found) for found in clouds] == [1] * len(log)
    for record, (cloud,) in zip(log, clouds, strict=True):
        layout = np.dtype(
            {
                "names": [item.name for item in cloud.fields],
                "formats": [sizes[item.type][0] for item in cloud.fields],
                "offsets": [item.offset for item in cloud.fields],
                "itemsize": cloud.point_stride,
            }
        )
        points = np.frombuffer(cloud.data, layout)
        for place, axis in enumerate((log.city.center_x_m, log.city.center_y_m, log.city.floors * STOREY_M + 0.6)):
            np.testing.assert_allclose(points["xyz"[place]], axis, rtol=1e-6)
        for name in ("temperature", "fuel_share", "water_litres", "fieryness"):
            assert np.array_equal(points[name], getattr(record.buildings, name))
        for building, code in enumerate(record.buildings.fieryness.tolist()):
            rgb = colors.REFUGE_RGB if building in refuges else colors.FIERYNESS_RGB[code]
            assert tuple(points[building][["red", "green", "blue", "alpha"]].tolist()) == (*rgb, 255)
        assert cloud.pose.orientation.w == 1.0


def test_roofs_of_all_touched_buildings_are_drawn_in_their_colors_whenever_one_changes(log):
    city, drawn, shown = log.city, messages_of(log, FIRE), None
    areas = [
        abs(sum(x[k - 1] * y[k] - x[k] * y[k - 1] for k in range(len(x)))) / 2
        for x, y in (
            (city.outline_x_m[a:b], city.outline_y_m[a:b])
            for a, b in zip(city.outline_ptr[:-1], city.outline_ptr[1:], strict=True)
        )
    ]
    n_drawn = 0
    for record, found in zip(log, drawn, strict=True):
        codes = record.buildings.fieryness.tolist()
        assert len(found) == (codes != shown)
        shown = codes
        if found:
            (entity,) = found[0].entities
            n_drawn += 1
            areas_by_color = {rgb_of(one.color): area_of(one) for one in entity.triangles}
            wanted: dict[tuple[int, int, int], float] = {}
            for code, area in zip(codes, areas, strict=True):
                if code:
                    rgb = colors.FIERYNESS_RGB[code]
                    wanted[rgb] = wanted.get(rgb, 0.0) + area
            assert areas_by_color == pytest.approx(wanted)
    assert 1 < n_drawn < len(log)


def area_of(triangles):
    at = np.array([(point.x, point.y) for point in triangles.points])
    a, b, c = (at[list(triangles.indices)[k::3]] for k in range(3))
    return float(np.abs((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]).sum() / 2)


def test_the_city_is_drawn_once(log):
    first, *rest = messages_of(log, CITY)
    assert rest == [[]] * (len(log) - 1)
    buildings, streets, hydrants = first[0].entities
    assert [one.id for one in first[0].entities] == ["buildings", "streets", "hydrants"]
    houses, refuges = buildings.triangles
    assert (rgb_of(houses.color), rgb_of(refuges.color)) == (colors.FIERYNESS_RGB[0], colors.REFUGE_RGB)
    n_corners, n_buildings = len(log.city.outline_x_m), len(log.city.building_id)
    n_triangles = (n_corners - 2 * n_buildings) + 2 * n_corners  # roofs, and two for each wall
    assert (len(houses.indices) + len(refuges.indices)) / 3 == n_triangles
    assert max(houses.indices) < len(houses.points)
    assert [text.text for text in buildings.texts] == [
        f"refuge {log.city.building_id[index]}" for index in log.city.refuge_building
    ]
    assert len(streets.lines[0].points) == 2 * len(log.city.street_from)
    assert streets.lines[0].type == 2
    assert len(hydrants.spheres) == len(log.city.hydrant_x_m)


def test_the_team_stands_where_it_stands(log):
    for record, (update,) in zip(log, messages_of(log, TEAM), strict=True):
        (entity,) = update.entities
        n = len(record.brigades.x_m)
        brigades, civilians = entity.spheres[:n], entity.spheres[n:]
        for brigade, ball in enumerate(brigades):
            position = ball.pose.position
            assert (position.x, position.y) == (record.brigades.x_m[brigade], record.brigades.y_m[brigade])
            assert rgb_of(ball.color) == colors.ACTIVITY_RGB[record.brigades.activity[brigade]]
            assert f"{record.brigades.tank_litres[brigade]} l" in entity.texts[brigade].text
            assert (entity.texts[brigade].font_size, entity.texts[brigade].billboard) == (6.0, True)
        assert len(civilians) == len(log.city.civilian_hp)
        n_jets = int(np.count_nonzero(record.brigades.sprayed_litres))
        assert sum(len(one.points) for one in entity.lines) == 2 * n_jets


def test_every_event_is_a_line(log):
    for record, lines in zip(log, messages_of(log, LOG), strict=True):
        assert len(lines) == len(record.events.kind)
        assert all(line.message and line.name == "fireworld" and 2 <= line.level <= 5 for line in lines)
    assert sum(map(len, messages_of(log, LOG))) > 0


def test_the_digest_does_not_know_of_scenes(here, fireworld, log):
    plain = json.loads(fireworld(*RUN, "--record", "plain.mcap").out)
    assert log.digest == plain["digest"]
    assert (log.state, log.damage) == ("complete", None)
    assert fireworld("diff", "plain.mcap", "a.mcap").code == 0
    assert fireworld("verify", "a.mcap").code == 0
    shown = fireworld("info", "a.mcap")
    assert shown.code == 0
    assert "/scene/points" in shown.out
    schema_text = fireworld("info", "a.mcap", "--schema").out
    assert "/scene/city  Drawn by other tools; derived from the step, and no part of the digest." in schema_text
    topics = json.loads(fireworld("info", "a.mcap", "--json").out)["topics"]
    assert topics["/scene/log"]["n_messages"] == topics_of_events(log)


def topics_of_events(log):
    return sum(len(record.events.kind) for record in log)


def test_recover_keeps_the_scene_of_the_good_steps(here, fireworld, log):
    whole = (here / "a.mcap").read_bytes()
    (here / "cut.mcap").write_bytes(whole[: len(whole) // 2])
    done = fireworld("recover", "cut.mcap", "-o", "b.mcap")
    assert done.code == 0
    rescued = open_log("b.mcap")
    n_good = len(rescued)
    assert 0 < n_good < len(log)
    for one, other in zip(rescued.raw_steps(), log.raw_steps(), strict=False):
        assert [(topic, bytes(data)) for topic, data in one] == [(topic, bytes(data)) for topic, data in other]
    assert fireworld(*RUN, "--steps", n_good - 1, "--record", "short.mcap", "--scene", "foxglove").code == 0
    assert [bytes(data) for raw in open_log("short.mcap").raw_steps() for topic, data in raw if "/scene/" in topic] == [
        bytes(data) for raw in rescued.raw_steps() for topic, data in raw if "/scene/" in topic
    ]


def test_the_same_run_gives_the_same_bytes(here, fireworld, log):
    assert fireworld(*RUN, "--record", "b.mcap", "--scene", "foxglove").code == 0
    assert (here / "a.mcap").read_bytes() == (here / "b.mcap").read_bytes()


def test_a_changed_scene_is_damage(here, log):
    """The chain does not hold the scene; the checksums of the file do."""
    content = bytearray((here / "a.mcap").read_bytes())
    content[len(content) // 2] ^= 1
    (here / "b.mcap").write_bytes(content)
    assert open_log("b.mcap", partial=True).state == "damaged"


def test_rerun_draws_the_points_and_the_log(here, log):
    from rerun.chunk import RrdReader

    done = rerun_program("mcap", "convert", "a.mcap", "-o", "a.rrd", "--include-topic-regex", "^/scene/")
    assert done.returncode == 0, done.stderr
    clouds, lines = {}, []
    for chunk in RrdReader("a.rrd").stream():
        batch = chunk.to_record_batch()
        if chunk.entity_path == POINTS and "Points3D:colors" in batch.schema.names:
            times = batch.column("message_log_time").cast("int64").to_pylist()
            rows = zip(times, batch.column("Points3D:positions"), batch.column("Points3D:colors"), strict=True)
            clouds |= {time // 60_000_000_000: (at.as_py(), rgba.as_py()) for time, at, rgba in rows}
        if chunk.entity_path == LOG and "TextLog:text" in batch.schema.names:
            lines += batch.column("TextLog:text").to_pylist()
    refuges = log.city.refuge_building
    assert sorted(clouds) == log.steps.tolist()
    for record in log:
        places, rgba = clouds[record.step]
        np.testing.assert_allclose(np.array(places)[:, 0], log.city.center_x_m, rtol=1e-6)
        wanted = colors.packed_table(colors.FIERYNESS_RGB)[record.buildings.fieryness]
        wanted[refuges] = colors.single(colors.REFUGE_RGB)
        assert rgba == wanted.tolist()
    assert len([line for line in lines if line]) == topics_of_events(log)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--scene", "foxglove"), "--scene goes with --record."),
        (("--scene", "gazebo", "--record", "a.mcap"), "'gazebo' is not 'foxglove'"),
    ],
)
def test_wrong_words(here, fireworld, words, message):
    done = fireworld("run", "quick", *words)
    assert (done.code, done.out) == (2, "")
    assert message in done.err
