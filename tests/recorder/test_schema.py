"""What is generated from the records is current, and what can never change has not changed."""

from fireworld_recorder import schema
from fireworld_recorder.schema import TOPICS, message_of
from google.protobuf import descriptor_pb2

from fireworld.records import DTYPES


def test_checked_in_descriptors_are_those_of_the_records():
    stored = descriptor_pb2.FileDescriptorSet.FromString(schema.DESCRIPTORS.read_bytes())
    assert stored == schema.build_descriptors(), "run `make docs`"


def test_checked_in_proto_file_is_current():
    assert schema.PROTO.read_text(encoding="utf-8") == schema.proto_text(), (
        "run `python -m fireworld_recorder.schema --write`"
    )


def test_docs_are_current():
    page = schema.DOCS.read_text(encoding="utf-8")
    assert page == schema.with_generated_part(page), "run `make docs`"
    for topic in TOPICS:
        assert f"### {topic.topic}\n" in page


def test_every_topic_carries_a_descriptor_set_of_its_own_message():
    names = []
    for message, data in schema.descriptors():
        files = descriptor_pb2.FileDescriptorSet.FromString(data).file
        assert len(files) == 1
        assert files[0].message_type[0].name == message.name
        names.append(message.topic)
    assert names == [topic.topic for topic in TOPICS]
    assert b"".join(data for _, data in schema.descriptors()) == schema.DESCRIPTORS.read_bytes()


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
