"""Logs of what learners played: bytes altered, and records that say odd things with all hashes right."""

import functools
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fireworld_recorder.chain import Chain
from fireworld_recorder.codec import decode, encode
from fireworld_recorder.header import to_metadata
from fireworld_recorder.schema import message_of
from fireworld_recorder.writer import StepFile
from hypothesis import given
from hypothesis import strategies as st

import fireworld as fw
from fireworld.errors import FireworldError
from fireworld.records import DTYPES
from fireworld.training.log.export import rows_of, tables_of
from fireworld.training.log.played import Played
from fireworld.training.log.records import TRAINING, PartCommit, channels_of
from fireworld.training.log.summary import training_summary
from fireworld.training.log.verify import verify_training
from tests.envs.played import play
from tests.envs.towns import HOT
from tests.fuzz.support import FOLDER, FUZZ, altered, file_of, only_complaints, target

pytestmark = pytest.mark.slow


@functools.cache
def good():
    """A log of a few episodes of a few steps, and its path."""
    path = Path(FOLDER.name) / "played.mcap"
    play(path, scenarios=[HOT], n=2, n_steps=14, steps=5, own_targets=2)
    log = fw.open_training(path)
    use(log)  # the kernels are compiled, and the city is built once
    return log


def use(log):
    """Do all that reads such a log."""
    acts = (
        training_summary,
        lambda log: [*log.reports()],
        lambda log: [*rows_of(log, tables_of(log))],
        lambda log: verify_training(log, jobs=1),
        lambda log: fw.diff(log, log),
        lambda log: fw.open_episode(log, 0),
    )
    for act in acts:
        try:
            act(log)
        except FireworldError as error:  # one kind of use may be refused where another is not
            if not str(error).isprintable():
                raise


@target
@FUZZ
@given(st.deferred(lambda: altered(good().path.read_bytes())))
def test_played_bytes(data):
    path = file_of(data, "altered-played.mcap")
    with only_complaints():
        use(fw.open_training(path, partial=True))


NUMBERS = st.sampled_from([0, 1, -1, 2, 5, 127, 2047, 2048, 2**31 - 1, -(2**31), 2**32, 2**63, 2**64 - 1])


@st.composite
def odd(draw, record):
    """Give some fields of a record other values, or other lengths."""
    for _ in range(draw(st.integers(1, 3))):
        item = draw(st.sampled_from(message_of(Played).fields))
        if item.repeated:
            kind = np.dtype(DTYPES[item.wire])
            raw = bytes(byte & 127 for byte in draw(st.binary(max_size=64)))
            column = np.frombuffer(raw[: len(raw) // kind.itemsize * kind.itemsize], kind)
            keep = draw(st.booleans())
            old = getattr(record, item.name)
            value = np.resize(column, len(old)) if keep and len(column) else column
        elif item.wire == "bytes":
            value = draw(st.binary(max_size=40))
        elif item.wire == "double":
            value = draw(st.floats())
        elif item.wire == "bool":
            value = draw(st.booleans())
        else:
            number = draw(NUMBERS)
            low, high = (-(2**31), 2**31 - 1) if item.wire == "sfixed32" else (0, 2**64 - 1)
            value = min(max(number, low), high)
        record = replace(record, **{item.name: value})
    return record


@target
@FUZZ
@given(st.data())
def test_played_records(data):
    log, path = good(), Path(FOLDER.name) / "odd-played.mcap"
    chain = Chain(log.found.first, TRAINING)
    header = log.header
    with StepFile(
        path,
        metadata=to_metadata(header, TRAINING),
        attachments=header.attachments,
        channels=channels_of((Played,)),
        city=log.found.first,
        kind=TRAINING,
        force=True,
    ) as file:
        for number, raw in enumerate(log.raw_parts()):
            message = encode(data.draw(odd(decode(Played, raw[0][1]))))
            chain.add(Played.topic, message)
            commit = encode(chain.seal(PartCommit(step=number, done=False, hash=b"")))
            file.commit(number, [(Played.topic, message), (PartCommit.topic, commit)])
    with only_complaints():
        use(fw.open_training(path, partial=True))
