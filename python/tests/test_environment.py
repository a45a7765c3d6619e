"""The environment: gymnasium's own check, the same bits as `policyc simulate`, and many against one."""

import os

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import policyc

PLANT, CONTRACT = "examples/plants/paper-model.toml", "examples/train/paper12/policy.toml"
CONTINUOUS = dict(
    plant="examples/plants/paper-model.toml",
    contract="tests/golden/cases/continuous",
    v_ref=12.0,
    episode={"loads": {"range": [5.0, 20.0]}, "steps": 50},
    set={"converter.v_in": 24.0, "converter.f_sw": 5e4},
)


def given(arguments):
    whole = {"plant": PLANT, "contract": CONTRACT, **arguments}
    if "training" in whole:
        return whole
    return {**whole, "episode": {"loads": {"range": [150.0, 1050.0]}, **whole.get("episode", {})}}


def make(**arguments):
    return gymnasium.make("policyc/Converter-v0", **given(arguments))


def make_vec(count, **arguments):
    return gymnasium.make_vec("policyc/Converter-v0", num_envs=count, vectorization_mode="vector_entry_point", **given(arguments))


# an observation without a clip has no bounds, which gymnasium remarks
@pytest.mark.filterwarnings("ignore:.*A Box observation space.*")
# a duty is what it is
@pytest.mark.filterwarnings("ignore:.*For Box action spaces.*")
@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("arguments", [{}, CONTINUOUS, {"training": "examples/train/paper12.toml", "plant": None, "contract": None}])
def test_gymnasium_finds_nothing_wrong(arguments):
    check_env(make(**arguments, render_mode="rgb_array").unwrapped)


@pytest.mark.parametrize("policy", ["examples/buck12", "examples/blind/policy"])
def test_observations_and_states_have_the_bits_of_simulate_over_a_hundred_thousand_steps(policy):
    lead, after = 50_100, 49_890
    task = {"lead": lead, "after": after, "tail": 100, "instants": 1, "sampling_instants": 1}
    scenario = {"load_steps": [[200, 500]], **task, "v_ref": 100.0, "baselines": [], "limit": False}
    plant = "examples/plants/sb3-buck12.toml"
    course = policyc.simulate(policy, plant, scenario).trajectories[("200-500W", "policy")]
    assert len(course["duty"]) == lead + after
    controller = policyc.Controller(policy)
    columns = {"v_out": "v_out_V", "i_l": "i_l_A", "i_out": "i_out_A", "v_in": "v_in_V"}
    # the sensors of this plant show what is
    steps = controller.step_batch(np.column_stack([course[columns[name]] for name in controller.signals]))
    assert (steps.duty == course["duty"]).all() and (steps.action_index == course["action"]).all()
    episode = {"steps": 10**6, "load_every": 10**6}
    env = make(plant=plant, contract=policy, v_ref=100.0, episode=episode, load_profile=[(0, 200), (lead, 500)]).unwrapped
    observation, info = env.reset(seed=1, options={"v_out": 100.0})
    rows = zip(*(course[name] for name in columns.values()), course["duty"], course["load_W"])
    for index, row in enumerate(rows):
        *state, duty, load = row
        assert [info[name] for name in columns] == state and info["load"] == load, index
        assert (observation == steps.observation[index].astype(np.float32)).all(), index
        observation, _, _, truncated, info = env.step(steps.action_index[index])
        assert info["duty"] == duty and not truncated


@pytest.mark.parametrize(
    ("arguments", "is_batch"),
    [
        ({}, True),
        ({"randomise": [{"key": "converter.inductance", "factor": [0.7, 1.3]}]}, True),
        ({"set": {"capacitor.esr": 0.03}, "episode": {"any_phase": True, "load_every": 7}}, True),
        ({"set": {"sensors.v_out.noise": 0.02}}, True),
        ({"set": {"capacitor.esr": 0.03, "pwm.carrier": 2}, "episode": {"any_phase": True, "load_every": 7}}, False),
        ({**CONTINUOUS}, True),
    ],
)
def test_many_converters_live_the_lives_of_single_ones(arguments, is_batch):
    count, periods = 9, 500
    many = make_vec(count, **arguments)
    alone = gymnasium.vector.SyncVectorEnv([lambda: make(**arguments) for _ in range(count)])
    assert many.unwrapped.is_batch == is_batch
    assert many.single_observation_space == alone.single_observation_space
    assert many.action_space == alone.action_space
    one, other = many.reset(seed=5), alone.reset(seed=5)
    assert (one[0] == other[0]).all()
    alone.action_space.seed(3)
    ended = 0
    for _ in range(periods):
        actions = alone.action_space.sample()
        one, other = many.step(actions), alone.step(actions)
        for mine, theirs in zip(one[:4], other[:4]):
            assert (mine == theirs).all() and mine.dtype == theirs.dtype
        running = ~many.unwrapped._never
        for name in ("v_out", "i_l", "i_out", "v_in", "duty", "load"):
            assert (one[4][name][running] == other[4][name][running]).all()
        assert many.observation_space.contains(one[0])
        ended += one[3].sum()
    assert ended


def test_an_episode_that_ends_is_followed_at_once_where_asked_for():
    later, at_once = make_vec(4, episode={"steps": 5}), make_vec(4, episode={"steps": 5}, autoreset_mode="same_step")
    assert (later.reset(seed=2)[0] == at_once.reset(seed=2)[0]).all()
    actions = np.full(4, 6)
    for _ in range(5):
        first, second = later.step(actions), at_once.step(actions)
    assert second[3].all() and (second[4]["final_obs"] == first[0]).all()
    begun = later.step(actions)
    assert (begun[0] == second[0]).all() and (begun[1] == 0).all() and not begun[3].any()


def test_equal_seeds_are_equal_lives_and_others_are_not():
    def life(seed):
        env = make(randomise=[{"key": "switch.v_f", "value": [0.0, 1.5]}])
        first, _ = env.reset(seed=seed)
        return np.array([first] + [env.step(4 + n % 4)[0] for n in range(150)])

    assert (life(1) == life(1)).all() and not (life(1) == life(2)).all()


def test_randomisation_reaches_the_converter():
    voltages = set()
    env = make(randomise=[{"key": "converter.v_in", "value": [180.0, 220.0]}])
    for seed in range(20):
        _, info = env.reset(seed=seed)
        voltages.add(info["v_in"])
    assert len(voltages) == 20 and 180 <= min(voltages) < 190 and 210 < max(voltages) <= 220


def test_the_reward_is_that_of_a_training_file():
    weights = {"bands": [[1.0, 2.0]], "error_weight": 3.0, "duty_change_weight": 5.0}
    env = make(reward=weights)
    _, info = env.reset(options={"v_out": 100.0, "load": 300.0})
    before = 0.5
    for action in (6, 7, 3):
        _, reward, _, _, info = env.step(action)
        error = abs(info["v_out"] - 100.0)
        assert reward == pytest.approx((2.0 if error <= 1.0 else 0.0) - 3.0 * error - 5.0 * abs(info["duty"] - before), rel=1e-12)
        before = info["duty"]


def test_a_lost_voltage_cuts_an_episode_short_and_terminates_none():
    env = make(episode={"max_error": 1.0})
    env.reset(options={"v_out": 100.0, "load": 1000.0})
    for _ in range(50):
        _, _, terminated, truncated, info = env.step(0)
        assert not terminated
        if truncated:
            break
    assert truncated and abs(info["v_out"] - 100.0) > 1.0


def test_an_episode_begins_without_what_the_last_one_left():
    env = make()
    for _ in range(2):
        _, info = env.reset(seed=4)
        assert (info["status"], info["duty"], info["period"]) == (0, 0.5, 0)
        info = env.step(3)[4]
        assert info["status"] & policyc.Status.PRIMED and info["period"] == 1


def test_the_contract_of_a_training_file_is_known(root):
    env = make(training="examples/train/paper12.toml", plant=None, contract=None).unwrapped
    assert os.path.samefile(env.contract, CONTRACT)


def test_other_kinds_of_load():
    for kind, load, i_out in (("current", 5.0, 5.0), ("resistance", 25.0, 4.0)):
        env = make(load_kind=kind, load_profile=[(0, load)])
        _, info = env.reset(options={"v_out": 100.0})
        assert (info["load"], info["i_out"]) == (load, i_out)


def test_a_picture_shows_the_episode():
    env = make(render_mode="rgb_array")
    env.reset(seed=1)
    before = env.render()
    for _ in range(60):
        env.step(8)
    after = env.render()
    assert after.shape == (240, 400, 3) and after.dtype == np.uint8 and (after != before).any()


@pytest.mark.parametrize(
    ("arguments", "error", "said"),
    [
        ({"plant": "examples/plants/nowhere.toml"}, policyc.Faults, "nowhere.toml"),
        ({"plant": None}, TypeError, "plant"),
        ({"episode": {"stepz": 3}}, policyc.Faults, "steps"),
        ({"randomise": [{"key": "switch.vf", "value": [0, 1]}]}, policyc.Faults, "switch.v_f"),
        ({"load_profile": [(3, 200.0)]}, policyc.Faults, "period 0"),
        ({"load_kind": "watt"}, policyc.Faults, "power"),
        ({"training": "examples/train/paper12.toml"}, TypeError, "leave out"),
        ({"set": {"converter.f_sw": 3e4}}, policyc.Faults, "control period"),
    ],
)
def test_what_does_not_fit_is_said(arguments, error, said):
    with pytest.raises(error, match=said):
        make(**arguments)


def test_actions_that_add_to_a_law_are_as_many_as_its_offsets():
    env = make(
        plant="examples/plants/paper-model.toml",
        contract="tests/golden/cases/residual",
        v_ref=5.0,
        episode={"loads": {"range": [5.0, 20.0]}, "steps": 50},
        set={"converter.v_in": 12.0, "converter.f_sw": 5e5, "load.v_fold": 1.0},
    ).unwrapped
    assert env.action_space.n == 5
    assert env.duties == pytest.approx([-0.1, -0.02, 0.0, 0.02, 0.1])
    env.reset(seed=1)
    commanded = [env.step(action)[4]["duty"] for action in (0, 4)]
    assert all(0.05 <= duty <= 0.95 for duty in commanded)


@pytest.mark.parametrize("case", ["observed", "residual", "adc_mapping"])
def test_the_contract_of_an_environment_is_written_whole(case, tmp_path):
    import json
    import shutil

    from policyc import contract as contracts
    from policyc._policyc import contract_json

    folder = f"tests/golden/cases/{case}"
    data = json.loads(contract_json(folder + "/policy.toml"))
    before = policyc.Policy.load(folder).inspect()
    entries = contracts.from_inspection(data)
    if entries.get("mapping"):
        entries["mapping"] = {"file": "drm.toml", **entries["mapping"]}
        shutil.copy(folder + "/drm.toml", tmp_path)
    shutil.copy(folder + "/weights.safetensors", tmp_path)
    words = json.dumps([layer.activation for layer in before.layers[:-1]])
    network = f'weights = "weights.safetensors"\nhidden_activation = {words}\n'
    (tmp_path / "policy.toml").write_text(contracts.text(entries, network, []))
    assert policyc.Policy.load(tmp_path).inspect().digests["contract"] == before.digests["contract"]
