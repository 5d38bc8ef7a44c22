"""`fireworld conformance`: its table, its JSON and its exit codes."""

import json

from tests.conformance.conftest import city_path, trace_arrays, trace_path


def test_all_pass(run_cli):
    code, out, err = run_cli(city_path("mini"), trace_path("mini"), trace_path("mini_v1"))
    lines = out.splitlines()
    assert code == 0
    assert err == ""
    assert lines[0].split() == [
        *("trace", "steps", "buildings", "codes", "energy", "temperature", "fuel", "water", "watered", "air", "tables")
    ]
    assert lines[2].split()[0] == str(trace_path("mini"))
    assert lines[2].split()[1:4] == ["120", "12", "0"]
    assert [line.split()[-1] for line in lines[2:4]] == ["PASS", "PASS"]


def test_requests_and_tanks_have_columns(run_cli):
    code, out, _ = run_cli(city_path("mini_brigades"), trace_path("mini_brigades"))
    assert code == 0
    assert out.splitlines()[0].split()[-3:] == ["requests", "tanks", "tables"]
    assert out.splitlines()[2].split()[-4:] == ["0", "0", "0", "PASS"]


def test_one_fails(run_cli, write):
    energy, wall_area = trace_arrays("mini")["energy"], trace_arrays("mini")["wall_area"]
    energy[40, 3] *= 2
    wall_area[0] += 1
    path = write(energy=energy, wall_area=wall_area)
    code, out, err = run_cli(city_path("mini"), trace_path("mini"), path)
    assert code == 1
    assert err == ""
    assert f"{path}: FAIL: first difference: step 40, building " in out
    assert f"{path}: FAIL: derived otherwise: wall_area: 1 of 12 differ" in out
    assert "5.0e-01" in out


def test_one_cannot_be_run(run_cli, write, tmp_path):
    code, out, err = run_cli(city_path("mini"), tmp_path / "none.npz", trace_path("mini"), write(params=None))
    assert code == 2
    assert out.splitlines()[2].endswith("PASS"), "the others are run"
    assert [line.split(": ")[0] for line in err.splitlines()] == ["fireworld", "fireworld"]
    assert "none.npz: expected a file that can be read" in err
    assert "params: expected this array to be there" in err


def test_a_city_that_cannot_be_read(run_cli, tmp_path):
    code, out, err = run_cli(tmp_path / "none.json", trace_path("mini"))
    assert (code, out) == (2, "")
    assert err.startswith(f"fireworld: {tmp_path / 'none.json'}: expected a city file that can be read")
    assert run_cli(city_path("mini"))[0] == 2, "no trace at all"


def test_json(run_cli, write):
    code, out, _ = run_cli(city_path("mini"), trace_path("mini"), "--json")
    report = json.loads(out)
    assert code == 0
    assert report["pass"]
    assert report["traces"][0]["outputs"]["fieryness"] == {"n_compared": 121 * 12, "n_differing": 0}
    assert report["traces"][0]["outputs"]["energy"]["largest_relative_difference"] < 1e-12
    codes = trace_arrays("mini")["fieryness"]
    codes[7, 2] = 8
    changed = write(fieryness=codes)
    broken = changed.with_name("broken.npz")
    code, out, err = run_cli(city_path("mini"), changed, broken, "--json")
    report = json.loads(out)
    assert code == 2
    assert not report["pass"]
    assert "broken.npz" in err
    assert list(report["not_run"]) == [str(broken)]
    first = report["traces"][0]["first_difference"]
    assert (first["step"], first["output"], first["values"]) == (7, "code", {"fireworld": 0, "trace": 8})
    assert first["energy"]["fireworld"] == first["energy"]["trace"]


def test_help_names_the_page(run_cli):
    code, out, _ = run_cli("--help")
    assert code == 0
    assert "docs/traces.md" in out
