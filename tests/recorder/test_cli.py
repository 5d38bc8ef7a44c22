"""The commands info, diff, recover and verify: what they say, and their exit codes."""

import json
import sys
import types

import pytest
from fireworld_recorder.header import to_metadata
from fireworld_recorder.schema import PROTO, Channel
from google.protobuf import descriptor_pb2

from fireworld.records import MemoryRecording
from tests.recorder import synthetic
from tests.recorder.conftest import write_log
from tests.recorder.test_damage import custom_log
from tests.recorder.test_diff import altered


@pytest.fixture
def cut_log(tmp_path, log_path):
    path = tmp_path / "cut.mcap"
    path.write_bytes(log_path.read_bytes()[:30_000])
    return path


@pytest.fixture
def other_log(tmp_path, records):
    other = altered(records, 21, "decisions", action=(1, 3), q_values=(7, 5.0))
    return write_log(tmp_path / "other.mcap", other, header=synthetic.header(policy="random"))


def test_info_of_a_complete_log(run_cli, log_path):
    code, out, _ = run_cli("info", log_path)
    assert code == 0
    for words in (
        "complete",
        "synthetic",
        "seed 7",
        "easiest",
        "31, from 0 to 30",
        "10, 20, 30",
        "/buildings",
        "4.500 of 5",
    ):
        assert words in out
    code, out, _ = run_cli("info", log_path, "--json")
    facts = json.loads(out)
    assert code == 0
    assert facts["state"] == "complete"
    assert facts["header"]["seed"] == "7"
    assert facts["topics"]["/commit"]["n_messages"] == 31
    assert facts["totals"]["n_burnt_out"] == 3
    assert run_cli("info", log_path, "--proto") == (0, PROTO.read_text(encoding="utf-8"), "")
    assert run_cli("info", "--proto") == run_cli("info", log_path, "--proto")


def test_schema_of_a_log_and_of_this_version(run_cli, log_path, cut_log):
    code, out, _ = run_cli("info", "--schema")
    assert code == 0
    assert out.startswith("fireworld-log/1\n\n/city  The city")
    assert "/buildings  The fire after the step. Phase: fire.\n" in out
    rows = [" ".join(line.split()) for line in out.splitlines()]
    assert "4 water_litres repeated sfixed32 (n,) litres water lying on the building" in rows
    assert "1 kind repeated uint32 (n_events,) index into EVENT_KINDS" in rows
    assert "2 Array.dtype string numpy type, such as <f8" in rows
    assert run_cli("info", log_path, "--schema") == (0, out, "")
    assert run_cli("info", cut_log, "--schema") == (1, out, "")
    code, out, _ = run_cli("info", "--schema", "--json")
    facts = json.loads(out)
    topics = {topic["topic"]: topic for topic in facts["topics"]}
    assert (code, facts["format"], topics["/commit"]["message"]) == (0, "fireworld-log/1", "fireworld.log.v1.Commit")
    assert topics["/buildings"]["phase"] == "fire"
    assert topics["/buildings"]["fields"][1] == {
        "number": 2,
        "name": "energy",
        "type": "repeated double",
        "shape": "n",
        "unit": "energy units",
        "doc": "heat, energy units, exact",
    }


def test_schema_lists_what_a_later_version_added(run_cli, tmp_path, records, city):
    files = descriptor_pb2.FileDescriptorSet()
    message = files.file.add(name="a.proto", package="fireworld.log.v1").message_type.add(name="Ambulances")
    kinds = descriptor_pb2.FieldDescriptorProto
    message.field.add(name="x_m", number=7, label=kinds.LABEL_REPEATED, type=kinds.TYPE_DOUBLE)
    message.field.add(name="mood", number=8, label=kinds.LABEL_OPTIONAL, type=kinds.TYPE_ENUM, type_name=".a.Mood")
    extra = Channel("/ambulances", "fireworld.log.v1.Ambulances", files.SerializeToString())

    def add(messages):
        return [("/ambulances", b""), *messages]

    path = custom_log(tmp_path / "later.mcap", records[:2], city, channels=[extra], change=add)
    code, out, _ = run_cli("info", path, "--schema")
    rows = [" ".join(line.split()) for line in out.splitlines()]
    assert code == 0
    assert "/ambulances Not known to this version; skipped." in rows
    assert "7 x_m repeated double (any,)" in rows
    assert "8 mood Mood" in rows
    code, out, _ = run_cli("info", path, "--schema", "--json")
    assert [topic["topic"] for topic in json.loads(out)["topics"] if not topic["known"]] == ["/ambulances"]
    assert run_cli("diff", path, path)[0] == 0
    broken = custom_log(tmp_path / "broken.mcap", records[:2], city, channels=[extra._replace(schema=b"\x0a\x09")])
    code, out, err = run_cli("info", broken, "--schema")
    assert (code, out) == (2, "")
    assert "broken.mcap: the schema of /ambulances is no protobuf descriptor" in err


@pytest.mark.parametrize("command", [("info",), ("info", "--schema"), ("verify",), ("export", "--parquet", "x")])
def test_a_newer_major_version_is_refused_with_a_clear_message(run_cli, tmp_path, records, city, command):
    path = tmp_path / "newer.mcap"
    custom_log(path, records[:2], city, metadata=to_metadata(synthetic.header()) | {"format": "fireworld-log/2"})
    code, out, err = run_cli(*command, path)
    assert (code, out) == (2, "")
    assert err == (
        f"fireworld: {path}: format: expected fireworld-log/1, got 'fireworld-log/2';"
        " it was written by a newer fireworld: try to upgrade\n"
    )


def test_names_in_a_log_cannot_steer_the_terminal(run_cli, tmp_path, records):
    header = synthetic.header(policy="\x1b[2Jmine\nstate complete")
    code, out, _ = run_cli("info", write_log(tmp_path / "a.mcap", records[:2], header=header))
    assert code == 0
    assert "policy       \\x1b[2Jmine\\nstate complete (" in out


def test_info_needs_a_log_or_says_what_does_without(run_cli, tmp_path):
    code, _, err = run_cli("info")
    assert code == 2
    assert "only --schema and --proto do without" in err
    assert run_cli("info", "--schema", "--proto")[0] == 2
    assert run_cli("info", tmp_path / "missing.mcap", "--schema")[0] == 2


def test_info_of_a_cut_off_damaged_and_unreadable_log(run_cli, cut_log, log_path, tmp_path):
    code, out, _ = run_cli("info", cut_log)
    assert code == 1
    assert "partial: the file ends inside a record; good up to step " in out
    data = bytearray(log_path.read_bytes())
    data[30_000] ^= 4
    (tmp_path / "flipped.mcap").write_bytes(data)
    code, out, _ = run_cli("info", tmp_path / "flipped.mcap", "--json")
    assert code == 1
    assert json.loads(out)["state"] == "damaged"
    (tmp_path / "other.txt").write_text("hello world")
    code, out, err = run_cli("info", tmp_path / "other.txt")
    assert (code, out) == (2, "")
    assert "expected an MCAP recording" in err


def test_info_of_a_log_without_steps(run_cli, tmp_path):
    path = write_log(tmp_path / "a.mcap", [])
    code, out, _ = run_cli("info", path)
    assert code == 0
    assert "none, of at most 500; no step" in out
    assert run_cli("info", path, "--json")[0] == 0


def test_diff_of_the_same_run(run_cli, log_path):
    code, out, _ = run_cli("diff", log_path, log_path)
    assert code == 0
    assert "the same: 31 steps" in out
    code, out, _ = run_cli("diff", log_path, log_path, "--json")
    assert code == 0
    assert json.loads(out)["same"] is True


def test_diff_of_two_runs(run_cli, log_path, other_log):
    code, out, _ = run_cli("diff", log_path, other_log)
    assert code == 1
    assert "step 21, choose: brigade 1 chose nearest-to-me, was nearest-to-civilian; Q of nearest-to-me" in out
    assert "policy: random, was easiest" in out
    assert "burnt out" in out
    assert "/decisions" in out
    code, out, _ = run_cli("diff", log_path, other_log, "--json")
    facts = json.loads(out)
    assert code == 1
    assert facts["first"]["step"] == 21
    assert facts["n_steps_differing"] == {"/decisions": 1}
    code, _, _ = run_cli("diff", log_path, other_log, "--tolerance", "action=2", "--tolerance", "decisions.q_values=9")
    assert code == 0


@pytest.mark.parametrize(
    ("tolerance", "words"),
    [("buildings.temp=1", "try buildings.temperature"), ("hp", "FIELD=X"), ("hp=-1", "X >= 0"), ("hp=nan", "X >= 0")],
)
def test_diff_refuses_bad_tolerances(run_cli, log_path, tolerance, words):
    code, _, err = run_cli("diff", log_path, log_path, "--tolerance", tolerance)
    assert code == 2
    assert words in " ".join(err.split())


def test_diff_that_cannot_compare(run_cli, log_path, cut_log, tmp_path):
    code, _, err = run_cli("diff", log_path, cut_log)
    assert code == 2
    assert "good up to step" in err
    assert "fireworld recover" in err
    code, _, err = run_cli("diff", log_path, tmp_path / "missing.mcap")
    assert code == 2
    assert "No such file" in err
    assert run_cli("diff", log_path)[0] == 2


def test_recover(run_cli, cut_log, tmp_path):
    output = tmp_path / "good.mcap"
    code, out, _ = run_cli("recover", cut_log, "-o", output)
    assert code == 0
    assert "good up to step" in out
    assert run_cli("info", output)[0] == 0
    code, _, err = run_cli("recover", cut_log, "-o", output)
    assert code == 2
    assert "--force" in err
    assert run_cli("recover", cut_log, "-o", output, "--force")[0] == 0
    code, _, err = run_cli("recover", tmp_path / "missing.mcap", "-o", tmp_path / "x.mcap")
    assert code == 2
    assert run_cli("recover", cut_log)[0] == 2


def test_verify(run_cli, log_path, cut_log, records, city, monkeypatch):
    replays = iter([records, records, altered(records, 4, "civilians", hp=(0, 1)), records[:5]])

    def replay(recording):
        assert recording.header == synthetic.header()
        return MemoryRecording(recording.header, city, next(replays))

    module = types.ModuleType("fireworld.recording.replay")
    module.Replay = replay
    monkeypatch.setitem(sys.modules, "fireworld.recording.replay", module)
    code, out, _ = run_cli("verify", log_path)
    assert code == 0
    assert "31 steps" in out
    code, out, _ = run_cli("verify", log_path, "--json")
    assert (code, json.loads(out)["same"]) == (0, True)
    code, out, _ = run_cli("verify", log_path)
    assert code == 1
    assert "step 4, health: civilian 0: hp is 1, was 996" in out
    code, out, _ = run_cli("verify", log_path, "--json")
    assert code == 1
    assert json.loads(out)["first"]["phase"] == "length"
    assert run_cli("verify", cut_log)[0] == 2
