"""Files that users hand over, altered or made up: scenarios, cities, teams, curricula. Only complaints come out."""

import io
import json
import zipfile

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from fireworld.city.formats.json_plan import parse_plan
from fireworld.conformance.city_file import load_city_file
from fireworld.errors import TrainingError
from fireworld.policy.teams.table_team import TableTeam
from fireworld.policy.teams.team import FORMAT, parse_team
from fireworld.scenario import parse_scenario
from fireworld.scenario.shipped import shipped_folder
from fireworld.training.curriculum import load_curriculum
from tests.city.plans import dump_plan
from tests.city.test_json_plan import CITY
from tests.fuzz.support import FOLDER, FUZZ, altered, changed, file_of, only_complaints, target

pytestmark = pytest.mark.slow

SCENARIO = (shipped_folder() / "test-1.yaml").read_bytes()
CURRICULUM = b"""description: two stages
stages:
  - {name: alone, cooperation: false, scenarios: [quick, train-1]}
  - name: together
    cooperation: true
    base: quick
    set: {steps: 40}
    vary: {brigades.n: [2, 3], fires.0.at: [[0.5, 0.5], [0.2, 0.3]]}
"""
CITY_TEXT = json.dumps(CITY, indent=1).encode()


def team_file() -> bytes:
    """A small team file."""
    path = file_of(b"", "team.npz")
    rows = np.arange(270 * 4).reshape(1, 270, 4)
    TableTeam(rows / 8.0, rows, {"method": {"commit": 2}}).save(path, force=True)
    return path.read_bytes()


def npz(arrays: dict[str, np.ndarray]) -> bytes:
    """Pack arrays as numpy does."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, array in arrays.items():
            with archive.open(f"{name}.npy", "w") as entry:
                np.lib.format.write_array(entry, array, allow_pickle=True)
    return file.getvalue()


def use_scenario(text: bytes) -> None:
    """Read a scenario and do with it what a run does before there is a city."""
    with only_complaints():
        scenario = parse_scenario(text, source="a.yaml")
        assert parse_scenario(scenario.to_yaml(), source="a.yaml").digest == scenario.digest
        assert scenario.with_settings({"steps": "7"}).steps == 7


def use_city(text: bytes) -> None:
    """Read a city, write it and read it again."""
    with only_complaints():
        plan = parse_plan(text, where="city.json")
        again = parse_plan(json.dumps(dump_plan(plan)).encode(), where="city.json")
        assert again.name == plan.name
    with only_complaints():
        load_city_file(file_of(text, "city.json"))


def use_team(data: bytes) -> None:
    """Read a team and let it choose."""
    with only_complaints():
        team = parse_team(data, source="team.npz")
        assert len(team.digest) == len(team.policy().digest) == 64
        assert team.commit >= 1


def use_curriculum(text: bytes) -> None:
    """Read a curriculum with all its scenarios."""
    with only_complaints():
        assert load_curriculum(file_of(text, "curriculum.yaml")).as_dict()["digest"]


def as_yaml(document: object) -> bytes:
    """Write a document in one of the ways of YAML."""
    return yaml.safe_dump(document, allow_unicode=True, sort_keys=False).encode("utf-8", "surrogatepass")


def as_json(document: object) -> bytes:
    """Write a document as JSON, which is YAML too."""
    return json.dumps(document).encode()


written = st.sampled_from([as_yaml, as_json])


@target
@FUZZ
@given(altered(SCENARIO))
def test_scenario_text(text):
    use_scenario(text)


@target
@FUZZ
@given(changed(yaml.safe_load(SCENARIO)), written)
def test_scenario_values(document, write):
    use_scenario(write(document))


@target
@FUZZ
@given(altered(CITY_TEXT))
def test_city_text(text):
    use_city(text)


@target
@FUZZ
@given(changed(CITY))
def test_city_values(document):
    use_city(as_json(document))


@target
@FUZZ
@given(altered(CURRICULUM))
def test_curriculum_text(text):
    use_curriculum(text)


@target
@FUZZ
@given(changed(yaml.safe_load(CURRICULUM)), written)
def test_curriculum_values(document, write):
    use_curriculum(write(document))


@target
@FUZZ
@given(altered(team_file()))
def test_team_bytes(data):
    use_team(data)


HEADER = {"format": FORMAT, "method": {"commit": 2}}
dtypes = st.sampled_from(["<f8", "<i8", "<f4", "|u1", "|b1", "<c16", "<U3", "|S2", ">f8", "<M8[s]", "O", "V3"])
shapes = st.sampled_from([(1, 270, 4), (2, 270, 4), (1, 4320, 4), (0, 270, 4), (270, 4), (), (3,), (1, 270, 0)])
headers = (changed(HEADER).map(as_json) | st.binary(max_size=40) | st.just(b"[" * 100_000)).map(
    lambda text: np.frombuffer(text, np.uint8)
)


@target
@FUZZ
@given(headers, st.lists(st.tuples(dtypes, shapes, st.sampled_from([0, 1, -1])), min_size=2, max_size=2))
def test_team_values(header, described):
    good = {"header": np.frombuffer(as_json(HEADER), np.uint8), "tables": np.zeros((1, 270, 4))}
    arrays = [np.full(shape, fill).astype(dtype) for dtype, shape, fill in described]
    use_team(npz({**good, "header": header, "visits": np.zeros((1, 270, 4), np.int64)}))
    use_team(npz({**good, "visits": arrays[0]}))
    use_team(npz({**good, "tables": arrays[0], "visits": arrays[1]}))


def test_a_team_file_that_unpacks_to_gigabytes_is_refused():
    """A zip of 1 MB that says it holds 1 GB of zeros; and an array that says so in a file that holds none."""
    zeros = io.BytesIO()
    with (
        zipfile.ZipFile(zeros, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive,
        archive.open("tables.npy", "w", force_zip64=True) as entry,
    ):
        np.lib.format.write_array_header_1_0(entry, {"descr": "<f8", "fortran_order": False, "shape": (2**27,)})
        block = bytes(1 << 20)
        for _ in range(400):
            entry.write(block)
    use_team(zeros.getvalue())
    for shape in ((2**40,), (2**62, 4), (2**63, 2**63), (-1,)):
        claim = io.BytesIO()
        with zipfile.ZipFile(claim, "w") as archive, archive.open("tables.npy", "w") as entry:
            np.lib.format.write_array_header_1_0(entry, {"descr": "<f8", "fortran_order": False, "shape": shape})
        use_team(claim.getvalue())


def test_the_good_files_are_read():
    """What is altered above is good before."""
    assert parse_scenario(SCENARIO, source="a").brigades.n
    assert len(parse_plan(CITY_TEXT, where="a").footprints.building_id) == 2
    assert parse_team(team_file(), source="a").commit == 2
    assert load_curriculum(file_of(CURRICULUM, "curriculum.yaml")).n_scenarios == 6
    assert FOLDER.name


@pytest.mark.parametrize(
    ("use", "data"),
    [
        pytest.param(use_scenario, SCENARIO + rb'name: "\ud800"', id="half-a-surrogate-pair"),
        pytest.param(use_scenario, rb'name: "\U00110000"', id="beyond-unicode"),
        pytest.param(use_scenario, b"%YAML " + b"9" * 5000 + b".1\n--- 1", id="a-version-of-thousands-of-digits"),
        pytest.param(use_curriculum, rb'{"sta\nges": 1, "stages": []}', id="a-key-with-a-line-break"),
        pytest.param(use_curriculum, CURRICULUM.replace(b"steps: 40", 'description: "🔥"'.encode()), id="a-flame"),
    ],
)
def test_what_fuzzing_found_stays_mended(use, data):
    use(data)


def test_a_header_of_brackets_within_brackets_is_refused():
    header = np.frombuffer(b"[" * 100_000, np.uint8)
    zeros = np.zeros((1, 270, 4))
    with pytest.raises(TrainingError, match="header: expected JSON"):
        parse_team(npz({"header": header, "tables": zeros, "visits": zeros.astype(np.int64)}), source="team.npz")
