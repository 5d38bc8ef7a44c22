"""What is generated from the records is current, and what can never change has not changed."""

import dataclasses
import importlib.util
import sys
from types import MappingProxyType
from typing import get_args

import pytest
from fireworld_recorder import schema, tables
from fireworld_recorder.schema import COUNTS, TOPICS, Commit, message_of
from fireworld_recorder.writer import own_channels
from google.protobuf import descriptor_pb2

from fireworld.records import DTYPES, STEP_TOPICS, CityRecord, Entity
from fireworld.training.log.records import TRAINING
from tests.docs import log_format


def test_descriptors_are_those_that_the_protobuf_library_makes_of_the_records():
    by_the_library = log_format.build_descriptors().SerializeToString(deterministic=True)
    assert b"".join(channel.schema for channel in own_channels(imported=True)) == by_the_library


def test_checked_in_proto_file_is_current():
    assert schema.PROTO.read_text(encoding="utf-8") == log_format.proto_text(), "run `make docs`"


@pytest.mark.parametrize(
    ("path", "topics"),
    [(log_format.PAGE, TOPICS), (log_format.TRAINING_PAGE, TRAINING.topics)],
    ids=["run", "training"],
)
def test_docs_are_current(path, topics):
    page = path.read_text(encoding="utf-8")
    assert page == log_format.with_generated_part(page), "run `make docs`"
    for topic in topics:
        assert f"### {topic.topic}\n" in page


def test_every_topic_carries_a_descriptor_set_of_its_own_message():
    names = []
    for topic, channel in zip(TOPICS, own_channels(imported=True), strict=True):
        files = descriptor_pb2.FileDescriptorSet.FromString(channel.schema).file
        assert len(files) == 1
        assert files[0].message_type[0].name == message_of(topic).name
        assert channel.schema_name == f"{schema.PACKAGE}.{message_of(topic).name}"
        names.append(channel.topic)
    assert names == [topic.topic for topic in TOPICS]


def test_field_numbers_are_unique_and_arrays_have_a_numpy_type():
    for topic in TOPICS:
        fields = message_of(topic).fields
        assert len({item.number for item in fields}) == len(fields)
        assert all(item.wire in DTYPES for item in fields if item.repeated)


def test_channel_order_is_fixed():
    assert [topic.topic for topic in TOPICS] == [
        "/city", "/draws", "/observations", "/decisions", "/brigades", "/buildings", "/civilians", "/rewards",
        "/score", "/events", "/snapshot", "/commit",
    ]  # fmt: skip


def columns_of(module):
    """What the tables of an export look like, but for the words."""
    return {
        table.name: [(column.name, column.dtype, column.unit, column.names) for column in table.columns]
        for table in module.TABLES.values()
    }


def test_rewording_the_docs_changes_no_shape_and_no_column(monkeypatch):
    shapes = [[(item.shape, item.per) for item in message_of(topic).fields] for topic in TOPICS]
    for topic in TOPICS:
        for item in dataclasses.fields(topic):
            if item.metadata:
                reworded = MappingProxyType({**item.metadata, "doc": "(n_sites,) 0 words, 1 other words"})
                monkeypatch.setattr(item, "metadata", reworded)
    assert {item.doc for topic in TOPICS for item in message_of(topic).fields} == {"(n_sites,) 0 words, 1 other words"}
    assert [[(item.shape, item.per) for item in message_of(topic).fields] for topic in TOPICS] == shapes
    spec = importlib.util.spec_from_file_location("tables_reworded", tables.__file__)
    again = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, "tables_reworded", again)
    spec.loader.exec_module(again)
    assert "words" in again.TABLES["buildings"].columns[2].doc
    assert columns_of(again) == columns_of(tables)


def test_every_array_says_what_it_has_entries_for():
    assert set(COUNTS) < set(get_args(Entity))
    for topic in TOPICS:
        for item in message_of(topic).fields:
            declared = next(field for field in dataclasses.fields(topic) if field.name == item.name)
            assert item.repeated == (declared.type == "Array")
            assert item.per in (get_args(Entity) if item.repeated else [""])


def test_every_field_of_a_step_is_in_one_table_of_the_export():
    indices = {"step", "building", "brigade", "civilian", "event"}
    q_columns = {column.name for column in tables.TABLES["decisions"].columns if column.name.startswith("q_")}
    assert len(q_columns) == 4
    found = [
        column.name
        for table in tables.TABLES.values()
        for column in table.columns
        if table.name != "city" and column.name not in indices and not column.names and column.name not in q_columns
    ]
    prefixes = {"/draws": "draw_", "/rewards": "reward_"}
    expected = [
        prefixes.get(topic.topic, "") + item.name
        for topic in (*STEP_TOPICS, Commit)
        for item in message_of(topic).fields
        if item.name not in {"q_values", "step", "hash"}
    ]
    assert sorted(found) == sorted(expected)
    names = {column.name for column in tables.TABLES["city"].columns} - {"building", "material_name"}
    assert names == {item.name for item in message_of(CityRecord).fields if item.per == "building"}
