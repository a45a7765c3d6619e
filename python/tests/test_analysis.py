"""Simulation, mapping and diagnosis: what the commands write, of arrays and frames."""

import csv
import subprocess

import numpy as np
import pytest

import policyc


def number(text):
    try:
        return float(text)
    except ValueError:
        return text


def columns(path):
    with open(path, encoding="utf-8") as read:
        rows = list(csv.DictReader(line for line in read if not line.startswith("#")))
    return {name: np.array([number(row[name]) for row in rows]) for name in rows[0]}


def test_a_simulation_has_the_files_of_the_command(program, tmp_path):
    scenario = tmp_path / "scenario.toml"
    scenario.write_text('load_steps = [[200, 500]]\ninstants = 2\nsampling_instants = 1\nlimit = false\nbaselines = ["feed-forward"]\n')
    options = ["--policy", "examples/buck12", "--plant", "examples/plants/paper-model.toml", "--out", str(tmp_path / "out")]
    subprocess.run([program, "simulate", str(scenario), *options], check=True, capture_output=True)
    found = policyc.simulate("examples/buck12", "examples/plants/paper-model.toml", scenario)
    for name in ("metrics.json", "metrics.csv", "200-500W-policy.csv", "200-500W-feed-forward.csv"):
        assert found.files[name].encode() == (tmp_path / "out" / name).read_bytes(), name
    course = found.trajectories[("200-500W", "feed-forward")]
    assert (course["v_out_V"] == columns(tmp_path / "out/200-500W-feed-forward.csv")["v_out_V"]).all()
    assert "deviation" in str(found) and "<iframe" in found._repr_html_()


def test_a_mapping_of_a_frame_is_that_of_its_file(program, tmp_path):
    pandas = pytest.importorskip("pandas")
    table = tmp_path / "table.csv"
    acquire = ["drm", "acquire", "--plant", "examples/plants/sb3-buck12.toml", "--duties", "0.45:0.02:0.55"]
    subprocess.run([program, *acquire, "--currents", "2,5,9", "--out", table], check=True, capture_output=True)
    subprocess.run([program, "drm", "fit", table, "--out", tmp_path / "drm.toml"], check=True, capture_output=True)
    points = columns(table)
    for given in (points, pandas.DataFrame(points), str(table)):
        found = policyc.drm_fit(given)
        numbers = lambda text: [line for line in text.splitlines() if line and not line.startswith("#")]  # noqa: E731
        assert numbers(found.toml) == numbers((tmp_path / "drm.toml").read_text())
    assert found.report and "<iframe" in found._repr_html_() and "d_real" in str(found)
    with pytest.raises(policyc.Faults, match="v_in"):
        policyc.drm_fit({name: values for name, values in points.items() if name != "v_in"})
    constant = {name: values for name, values in points.items() if name != "v_in"}
    assert numbers(policyc.drm_fit(constant, v_in=points["v_in"][0]).toml) == numbers(found.toml)


def test_a_diagnosis_of_arrays_names_what_the_records_hide():
    record = columns("examples/diagnose/records/nothing-wrong.csv")
    found = policyc.diagnose("examples/blind/plant.toml", record)
    again = policyc.diagnose("examples/blind/plant.toml", "examples/diagnose/records/nothing-wrong.csv")
    assert (found.verdict, found.sentence) == (again.verdict, again.sentence)
    assert found.verdict and "[converter]" in found.plant and found.mapping is None
    assert "<iframe" in found._repr_html_()


def test_what_is_no_table_is_said():
    with pytest.raises(ValueError, match="one length"):
        policyc.drm_fit({"duty": [0.5], "v_out": [100.0, 101.0]})
    with pytest.raises(TypeError, match="a table is"):
        policyc.drm_fit(np.zeros((3, 4)))


def test_frames_of_polars_are_tables_as_well():
    polars = pytest.importorskip("polars")
    points = {"duty": [0.45, 0.5, 0.55] * 2, "v_out": [88.0, 98.0, 108.0, 87.0, 97.0, 107.0], "i_out": [2.0] * 3 + [6.0] * 3, "v_in": [200.0] * 6}
    assert policyc.drm.fit(polars.DataFrame(points)).toml == policyc.drm_fit(points).toml
    record = columns("examples/diagnose/records/nothing-wrong.csv")
    found = policyc.diagnose("examples/blind/plant.toml", polars.DataFrame(record))
    assert found.sentence == policyc.diagnose("examples/blind/plant.toml", record).sentence
    rows = {"v_out": [99.0] * 4, "i_l": [10.0] * 4, "i_out": [9.8] * 4}
    steps = policyc.Controller("examples/buck12").step_batch(polars.DataFrame(rows))
    assert (steps.duty == policyc.Controller("examples/buck12").step_batch(np.column_stack(list(rows.values()))).duty).all()
