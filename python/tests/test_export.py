"""Export of saved models; that of live ones stands in `trainers`, with the libraries."""

import numpy as np
import pytest

import policyc
from policyc import contract, models, wrappers

SIGNALS = [policyc.Signal(f"x_{index}", "1", (-25.0, 25.0)) for index in range(6)]
SAID = dict(
    name="saved", sample_period=1e-4, signals=SIGNALS, limits={"duty": [0.05, 0.95]}, fallback={"duty": 0.0, "hold": 3}, verify=300
)
TRAINERS = "tests/fixtures/trainers"


def tensors(path):
    """A safetensors file, without its library."""
    import json
    import struct

    content = open(path, "rb").read()
    [length] = struct.unpack("<Q", content[:8])
    header = json.loads(content[8 : 8 + length])
    kinds = {"F32": np.float32, "I32": np.int32}
    read = {}
    for name, entry in header.items():
        if name != "__metadata__":
            begin, end = entry["data_offsets"]
            data = content[8 + length + begin : 8 + length + end]
            read[name] = np.frombuffer(data, kinds[entry["dtype"]]).reshape(entry["shape"])
    return read


@pytest.mark.parametrize("model", ["sb3_dqn.zip", "sb3_a2c.zip", "sb3_qrdqn.zip", "gemm.onnx", "dueling.pth"])
def test_a_saved_model_becomes_a_policy_that_answers_as_its_library_did(model, tmp_path):
    expected = tensors(f"{TRAINERS}/{model.split('.')[0]}.expected.safetensors")
    duties = list(np.linspace(0.3, 0.7, expected["q"].shape[1]))
    more = {"actions": len(duties)} if "qrdqn" in model else {"activation": "relu"} if "dueling" in model else {}
    policy = policyc.export(f"{TRAINERS}/{model}", tmp_path / "out", duties=duties, **SAID, **more)
    steps = policyc.Controller(policy).step_batch(expected["obs"].astype(np.float64))
    if "dueling" not in model:
        assert np.allclose(steps.outputs, expected["q"], rtol=1e-4, atol=1e-4)
    assert (steps.action_index == expected["q"].argmax(axis=1)).mean() > 0.98
    assert policy.inspect().duties == pytest.approx(duties)


@pytest.mark.parametrize("model", ["sb3_sac_duty.zip", "sb3_ppo_duty.zip", "sb3_td3_duty.zip", "tanh_actor.onnx", "sigmoid_actor.onnx"])
def test_a_saved_actor_commands_what_its_library_did(model, tmp_path):
    expected = tensors(f"{TRAINERS}/{model.split('.')[0]}.expected.safetensors")
    policy = policyc.export(f"{TRAINERS}/{model}", tmp_path / "out", **SAID)
    steps = policyc.Controller(policy).step_batch(expected["obs"].astype(np.float64))
    assert np.allclose(steps.duty_sim, expected["duty"].reshape(-1), atol=1e-5)


def test_a_clip_with_a_scale_behind_it_is_refused_and_not_guessed(tmp_path):
    with pytest.raises(ValueError, match="policyc new"):
        policyc.export(f"{TRAINERS}/clipped_actor.onnx", tmp_path / "out", **SAID)


def test_what_is_missing_is_said_and_nothing_is_written(tmp_path):
    with pytest.raises(ValueError, match="duties"):
        policyc.export(f"{TRAINERS}/sb3_dqn.zip", tmp_path / "out", **SAID)
    with pytest.raises(policyc.Faults, match="model.zip"):
        policyc.export(f"{TRAINERS}/sb3_dqn.zip".replace("dqn", "none"), tmp_path / "out", duties=[0.5], **SAID)
    with pytest.raises(TypeError, match="neither"):
        policyc.export(3, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_the_file_of_answers_holds_what_was_put_in(tmp_path):
    given = {"obs": np.arange(12, dtype=np.float32).reshape(4, 3), "action": np.array([3, 1, 2, 0], np.int32)}
    path = tmp_path / "a.safetensors"
    path.write_bytes(models.safetensors(given))
    found = tensors(path)
    assert all((found[name] == given[name]).all() for name in given)
    assert models.safetensors(given) == models.safetensors(dict(reversed(given.items())))


@pytest.mark.parametrize("limit", [None, 4.0, 0.5])
def test_a_normalised_feature_is_the_feature_normalised(limit):
    """One affine map and one clip against both of them, one after the other."""
    feature = {"scale": 0.2, "offset": -0.1, "clip": [-3.0, 5.0]}
    found = contract.normalised(feature, (0.7, 0.4, limit))
    for x in np.linspace(-60, 60, 401):
        inner = np.clip(0.2 * x - 0.1, -3.0, 5.0)
        outer = 0.7 * inner + 0.4
        expected = outer if limit is None else np.clip(outer, -limit, limit)
        assert np.clip(found["scale"] * x + found["offset"], *found["clip"]) == pytest.approx(expected, abs=1e-12)


def test_a_contract_is_written_as_it_was_read(tmp_path):
    """Through the package's own text: the digests of contract and mapping are over content."""
    import json
    import shutil

    from policyc._policyc import contract_json

    for example in ("tests/golden/cases/filters", "tests/golden/cases/adc_mapping", "examples/buck12", "tests/golden/cases/continuous"):
        data = json.loads(contract_json(f"{example}/policy.toml"))
        entries = contract.from_inspection(data)
        if data["continuous"] is not None:
            entries["actions"] = {"continuous": {"squash": "tanh", "scale": 0.35, "offset": 0.5}}
        original = open(f"{example}/policy.toml", encoding="utf-8").read()
        network = original.split("\n[network]\n", 1)[1].split("\n[", 1)[0] + "\n"
        folder = tmp_path / example.replace("/", "_")
        shutil.copytree(example, folder)
        mapping = contract.mapping_file(data["files"])
        if mapping is not None:
            entries["mapping"] = {"file": "drm.toml", **entries["mapping"]}
        (folder / "policy.toml").write_text(contract.text(entries, network, []))
        digests = [policyc.Policy.load(path).inspect().digests for path in (example, folder)]
        assert digests[0] == digests[1], example


def test_a_rescaled_action_is_followed_outwards():
    """Two wrappers, one in the other."""

    class Space:
        def __init__(self, low, high):
            self.low, self.high = np.array([low], np.float32), np.array([high], np.float32)

    class RescaleAction:
        def __init__(self, env, low, high):
            self.env, self.action_space = env, Space(low, high)

    class Inner:
        action_space = Space(0.25, 0.75)

    chain = wrappers.read(RescaleAction(RescaleAction(Inner(), 0.0, 10.0), -1.0, 1.0))
    assert [chain.gain * action + chain.shift for action in (-1.0, 0.0, 1.0)] == pytest.approx([0.25, 0.5, 0.75])


def test_stacked_features_look_back_and_the_oldest_is_first():
    features = [{"name": "a", "source": "x", "filters": ["backward_difference"]}, {"name": "b", "source": "y", "scale": 2.0}]
    found = contract.stacked(features, 3)
    assert [feature["name"] for feature in found] == ["a_back2", "b_back2", "a_back1", "b_back1", "a", "b"]
    assert found[0]["filters"] == ["backward_difference", {"delay": 2}] and found[3]["filters"] == [{"delay": 1}]
    assert found[1]["scale"] == 2.0 and found[4:] == features


def test_wrappers_that_stack_are_read_in_their_order():
    class Inner:
        pass

    class FrameStackObservation:
        stack_size, padding_type = 3, "zero"

        def __init__(self, env):
            self.env = env

    class NormalizeObservation:
        epsilon = 0.0

        def __init__(self, env, shape):
            self.env, self.obs_rms = env, type("Statistics", (), {"mean": np.ones(shape), "var": np.full(shape, 4.0)})

    chain = wrappers.read(NormalizeObservation(FrameStackObservation(NormalizeObservation(Inner(), 2)), (3, 2)))
    one = (0.5, -0.5, None)
    assert chain.observed == [[one] * 2, 3, [one] * 6]
    assert any("padding" in line for line in chain.said)
    outermost, innermost = (env for env, _ in chain.statistics)
    outermost.update_running_mean, innermost.update_running_mean = True, False
    with wrappers.held(chain):
        assert not outermost.update_running_mean and not innermost.update_running_mean
    assert outermost.update_running_mean and not innermost.update_running_mean
