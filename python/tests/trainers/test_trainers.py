"""The real libraries, in an environment of their own: train, export, verify, compile. `cargo xtask test --full` runs it."""

import gymnasium
import numpy as np
import pytest
import stable_baselines3
import torch
from sb3_contrib import QRDQN
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.vec_env import VecFrameStack, VecNormalize

import policyc

# small networks: more threads wait for each other
torch.set_num_threads(1)

PLANT = "examples/plants/paper-model.toml"
LOADS = {"loads": {"range": [150.0, 1050.0]}}
DUTIES, NUMBER = "examples/train/paper12/policy.toml", "number/policy.toml"


def small(**more):
    """A small network; anew for each model, because the library writes into what it is given."""
    return {"policy_kwargs": {"net_arch": [32, 32]}, "seed": 1, "device": "cpu", **more}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("trainers")


@pytest.fixture
def number(root, folder):
    """The paper's contract with a number in the place of its duties."""
    text = (root / DUTIES).read_text()
    begin, end = text.index("duties = ["), text.index("]\n", text.index("duties = [")) + 2
    path = folder / "number.toml"
    path.write_text(text[:begin] + 'continuous = { squash = "tanh", scale = 0.055, offset = 0.495 }\n' + text[end:])
    return str(path)


def test_a_dqn_becomes_verified_code(tmp_path):
    env = gymnasium.make("policyc/Converter-v0", plant=PLANT, contract=DUTIES, episode=LOADS)
    model = stable_baselines3.DQN("MlpPolicy", env, **small()).learn(2000)
    policy = policyc.export(model, tmp_path / "policy")
    assert policy.verify(steps=2000).equal
    assert "paper12.c" in policy.compile("cortex-m4f", "c")


def test_a_ppo_becomes_verified_code(tmp_path):
    env = gymnasium.make("policyc/Converter-v0", plant=PLANT, contract=DUTIES, episode=LOADS)
    model = stable_baselines3.PPO("MlpPolicy", env, n_steps=500, batch_size=100, **small()).learn(2000)
    policy = policyc.export(model, tmp_path / "policy")
    assert policy.verify(steps=2000).equal
    assert "paper12.c" in policy.compile("cortex-m4f", "c")


def test_a_sac_becomes_verified_code(tmp_path, number):
    env = gymnasium.make("policyc/Converter-v0", plant=PLANT, contract=number, episode=LOADS)
    model = stable_baselines3.SAC("MlpPolicy", env, learning_starts=1500, **small()).learn(2000)
    policy = policyc.export(model, tmp_path / "policy")
    assert policy.verify(steps=2000).equal
    assert "paper12.c" in policy.compile("cortex-m4f", "c")


@pytest.mark.parametrize("algorithm", ["A2C", "QRDQN", "TD3", "DDPG", "PPO"])
def test_the_other_algorithms(algorithm, tmp_path, number):
    """PPO here with a number as its action, which is clipped."""
    contract = DUTIES if algorithm in ("A2C", "QRDQN") else number
    env = gymnasium.make("policyc/Converter-v0", plant=PLANT, contract=contract, episode=LOADS)
    kind = QRDQN if algorithm == "QRDQN" else getattr(stable_baselines3, algorithm)
    more = {"n_steps": 100} if algorithm in ("A2C", "PPO") else {"learning_starts": 100}
    model = kind("MlpPolicy", env, **small(**more)).learn(200)
    policy = policyc.export(model, tmp_path / "policy", name="other", verify=500)
    assert policy.name == "other" and policy.inspect().golden_vectors == 128
    hold(policy, model, env)


def hold(policy, model, env, normalise=lambda observation: observation):
    """The controller commands at the environment what the model itself would choose there."""
    controller = policyc.Controller(policy)
    observation, info = env.reset(seed=9)
    same = 0
    for _ in range(300):
        command = controller.step([info["measured"][name] for name in controller.signals])
        action, _ = model.predict(normalise(observation), deterministic=True)
        if policy.inspect().duties:
            same += command.action_index == action
        else:
            same += abs(command.duty_sim - float(action[0])) < 1e-5
        observation, _, _, truncated, info = env.step(action)
        assert info["duty"] == pytest.approx(command.duty, abs=1e-5) or policy.inspect().duties
        if truncated:
            break
    # a choice between two that are equal to rounding may fall the other way
    assert same >= 299


def test_normalised_observations_are_read(tmp_path):
    arguments = {"plant": PLANT, "contract": DUTIES, "episode": LOADS}
    vector = VecNormalize(make_vec_env("policyc/Converter-v0", 2, env_kwargs=arguments), clip_obs=4.0)
    model = stable_baselines3.PPO("MlpPolicy", vector, n_steps=100, batch_size=100, **small()).learn(400)
    policy = policyc.export(model, tmp_path / "policy", verify=500)
    features = policy.inspect().features
    assert all(feature.clip[1] <= 4.0 for feature in features) and features[0].scale != 0.2
    env = gymnasium.make("policyc/Converter-v0", **arguments)
    hold(policy, model, env, vector.normalize_obs)


def test_wrappers_are_read_or_refused_by_name(tmp_path, number):
    arguments = {"plant": PLANT, "contract": number, "episode": LOADS}
    env = gymnasium.wrappers.RescaleAction(gymnasium.make("policyc/Converter-v0", **arguments), -1.0, 1.0)
    env = gymnasium.wrappers.FlattenObservation(env)
    model = stable_baselines3.SAC("MlpPolicy", env, learning_starts=100, **small()).learn(150)
    policy = policyc.export(model, tmp_path / "policy", verify=500)
    assert policy.inspect().json["continuous"]["scale"] == pytest.approx(0.055, rel=1e-5)
    delayed = gymnasium.wrappers.DelayObservation(gymnasium.make("policyc/Converter-v0", **{**arguments, "contract": DUTIES}), 1)
    model = stable_baselines3.DQN("MlpPolicy", delayed, **small())
    with pytest.raises(ValueError, match="DelayObservation"):
        policyc.export(model, tmp_path / "delayed")
    assert not (tmp_path / "delayed").exists()


def test_stacked_observations_are_features_with_a_delay(tmp_path, number):
    arguments = {"plant": PLANT, "contract": DUTIES, "episode": LOADS}
    env = gymnasium.wrappers.FrameStackObservation(gymnasium.make("policyc/Converter-v0", **arguments), 3)
    model = stable_baselines3.DQN("MlpPolicy", env, learning_starts=100, **small()).learn(200)
    policy = policyc.export(model, tmp_path / "policy", verify=500)
    assert policy.inspect().golden_vectors == 128
    assert len(policy.inspect().features) == 3 * env.observation_space.shape[1]
    hold(policy, model, env)
    # a number as the action
    arguments["contract"] = number
    env = gymnasium.wrappers.FrameStackObservation(gymnasium.make("policyc/Converter-v0", **arguments), 2)
    model = stable_baselines3.SAC("MlpPolicy", env, learning_starts=100, **small()).learn(150)
    hold(policyc.export(model, tmp_path / "number", verify=500), model, env)


def test_stacked_observations_are_read_on_either_side_of_their_normalisation(tmp_path):
    arguments = {"plant": PLANT, "contract": DUTIES, "episode": LOADS}
    for name, wrap in {
        "outside": lambda env: VecFrameStack(VecNormalize(env, clip_obs=4.0), 2),
        "inside": lambda env: VecNormalize(VecFrameStack(env, 2), clip_obs=4.0),
    }.items():
        vector = wrap(make_vec_env("policyc/Converter-v0", 1, env_kwargs=arguments))
        model = stable_baselines3.PPO("MlpPolicy", vector, n_steps=100, batch_size=100, **small()).learn(200)
        normal = vector if name == "inside" else vector.venv
        before = normal.obs_rms.mean.copy(), normal.obs_rms.count
        policy = policyc.export(model, tmp_path / name, verify=500)
        assert (before[0] == normal.obs_rms.mean).all() and before[1] == normal.obs_rms.count and normal.training
        controller = policyc.Controller(policy)
        inner = gymnasium.make("policyc/Converter-v0", **arguments)
        latest, info = inner.reset(seed=9)
        before, same = latest, 0
        for _ in range(200):
            command = controller.step([info["measured"][signal] for signal in controller.signals])
            if name == "inside":
                seen = normal.normalize_obs(np.concatenate([before, latest]))
            else:
                seen = np.concatenate([normal.normalize_obs(before), normal.normalize_obs(latest)])
            action, _ = model.predict(seen, deterministic=True)
            same += command.action_index == action
            before = latest
            latest, _, _, _, info = inner.step(action)
        assert same >= 199, name


def test_a_module_of_torch_becomes_verified_code(tmp_path):
    torch.manual_seed(3)
    nn = torch.nn
    module = nn.Sequential(nn.Linear(6, 16), nn.Tanh(), nn.Linear(16, 16), nn.ReLU(), nn.Linear(16, 12))
    env = gymnasium.make("policyc/Converter-v0", plant=PLANT, contract=DUTIES, episode=LOADS)
    policy = policyc.export(module, tmp_path / "policy", env=env, verify=500)
    assert policy.inspect().golden_vectors == 128
    # layers in another order than they are called in give other answers
    class Crossed(nn.Module):
        def __init__(self):
            super().__init__()
            self.second, self.first, self.act = nn.Linear(6, 12), nn.Linear(6, 6), nn.ReLU()

        def forward(self, x):
            return self.second(self.act(self.first(x)))

    with pytest.raises((ValueError, policyc.Faults)):
        policyc.export(Crossed(), tmp_path / "crossed", env=env)
    assert not (tmp_path / "crossed").exists()


def test_a_policy_holds_what_its_model_learnt_elsewhere(tmp_path):
    """An environment of somebody else, whose spaces are all that is known of it."""

    class Elsewhere(gymnasium.Env):
        observation_space = gymnasium.spaces.Box(np.float32(-2), np.float32(2), (3,))
        action_space = gymnasium.spaces.Discrete(4)

        def reset(self, *, seed=None, options=None):
            super().reset(seed=seed)
            return self.np_random.uniform(-2, 2, 3).astype(np.float32), {}

        def step(self, action):
            return self.np_random.uniform(-2, 2, 3).astype(np.float32), 0.0, False, False, {}

    model = stable_baselines3.DQN("MlpPolicy", Elsewhere(), **small())
    said = dict(
        name="elsewhere",
        sample_period=1e-4,
        signals=[policyc.Signal(name, "V", (-2.0, 2.0)) for name in "abc"],
        duties=[0.2, 0.4, 0.6, 0.8],
        limits={"duty": [0.1, 0.9]},
        fallback={"duty": 0.0, "hold": 3},
    )
    with pytest.raises(ValueError, match="sample_period"):
        policyc.export(model, tmp_path / "policy", **{**said, "sample_period": None})
    policy = policyc.export(model, tmp_path / "policy", verify=500, **said)
    assert policy.inspect().duties == [0.2, 0.4, 0.6, 0.8]
    with pytest.raises(FileExistsError, match="overwrite"):
        policyc.export(model, tmp_path / "policy", **said)
