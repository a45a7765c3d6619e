"""A desk for the tests of campaigns: a training of less than a second, a scenario, a policy and two plants."""

import os
import pathlib
import shutil

import pytest

TRAIN = """
plant = "plants/paper-model.toml"
contract = "contract/policy.toml"
steps = 600

[network]
hidden = [8]

[learning]
batch = 16
warm_up = 100

[reward]
v_ref = 100.0

[episode]
loads = { values = [200, 500, 800, 1000], range = [150, 1050], share = 0.5 }

[selection]
every = 200
load_steps = [[210, 480]]
instants = 1
lead = 20
after = 40
tail = 10

[evaluation]
load_steps = [[200, 500]]
instants = 1
lead = 20
after = 40
tail = 10
"""

SCENARIO = """
load_steps = [[200, 500]]
instants = 1
sampling_instants = 1
lead = 20
after = 40
tail = 10
limit = false
baselines = ["feed-forward"]
"""

PLAN = {
    "name": "Both",
    "train": [{"settings": "train.toml", "seeds": [1, 2]}],
    "simulate": [{"scenarios": "scenario.toml", "policies": "policy", "plants": "plants/paper-model.toml"}],
}

TEXT = """
name = "Both"

[[train]]
settings = "train.toml"
seeds = [1, 2]

[[simulate]]
scenarios = "scenario.toml"
policies = "policy"
plants = "plants/paper-model.toml"
"""


@pytest.fixture
def desk(root, tmp_path, monkeypatch):
    """A working folder with everything that the plan names."""
    for source, target in (("plants", "plants"), ("train/paper12", "contract"), ("buck12", "policy")):
        shutil.copytree(root / "examples" / source, tmp_path / target)
    for name, text in (("train.toml", TRAIN), ("scenario.toml", SCENARIO), ("plan.toml", TEXT)):
        (tmp_path / name).write_text(text)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def contents(folder):
    """Path and bytes of every file."""
    folder = pathlib.Path(folder)
    return {os.fspath(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}
