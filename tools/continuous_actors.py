"""Continuous actors of Stable-Baselines3 on the bench of examples/train/measured.toml, for the table in docs/results/training.md.

    python tools/continuous_actors.py OUT [STEPS]     # in the checkout; needs the wheel and stable-baselines3

Features, observer, plant, sensors, delay, loads and reward are those of the residual DQN. Only the head differs: the actor commands the
duty itself, 0 to 1, as a converter without a law would have it. Each policy is exported, verified and simulated on the load steps of
examples/simulate/measured.toml, where `policyc` writes the figures.
"""

import pathlib
import re
import subprocess
import sys
import time

import gymnasium
import policyc
import tomllib
from stable_baselines3 import SAC, TD3
from stable_baselines3.common.noise import NormalActionNoise

ROOT = pathlib.Path(__file__).resolve().parent.parent
SEEDS = (11, 12, 13)
STEPS = 10_000


def contract(folder: pathlib.Path) -> pathlib.Path:
    """The contract of examples/train/measured with an actor in the place of law and offsets."""
    text = (ROOT / "examples/train/measured/policy.toml").read_text()
    start, end = text.index("[actions]"), text.index("[limits]")
    head = '[actions]\ncontinuous = { squash = "tanh", scale = 0.5, offset = 0.5 }\n\n'
    path = folder / "policy.toml"
    path.write_text(re.sub(r'^golden = .*\n', "", text[:start] + head + text[end:], flags=re.M))
    return path


def trained(kind, seed: int, steps: int, folder: pathlib.Path):
    training = tomllib.loads((ROOT / "examples/train/measured.toml").read_text())
    folder.mkdir(parents=True, exist_ok=True)
    env = gymnasium.make(
        "policyc/Converter-v0",
        plant=ROOT / "examples/plants/paper-model.toml",
        contract=contract(folder),
        reward=training["reward"],
        episode=training["episode"],
        set=training["set"],
        randomise=training.get("randomise", ()),
    )
    # what the residual DQN has, where the algorithm has it; learning rates are the library's
    options = dict(
        policy_kwargs=dict(net_arch=[64, 64]), gamma=0.95, batch_size=256, buffer_size=200_000, learning_starts=256, seed=seed, device="cpu"
    )
    if kind is TD3:
        options["action_noise"] = NormalActionNoise([0.0], [0.1])
    return kind("MlpPolicy", env, **options).learn(steps), env


def main() -> None:
    out = pathlib.Path(sys.argv[1])
    steps = int(sys.argv[2]) if len(sys.argv) > 2 else STEPS
    for kind in (TD3, SAC):
        for seed in SEEDS:
            folder = out / f"{kind.__name__}-{seed}-{steps}"
            begun = time.time()
            model, env = trained(kind, seed, steps, folder / "contract")
            seconds = time.time() - begun
            policy = policyc.export(model, folder / "policy", env=env, verify=200, overwrite=True)
            line = ["simulate", ROOT / "examples/simulate/measured.toml", "--policy", policy.path, "--out", folder / "loop"]
            subprocess.run([sys.executable, "-m", "policyc", *map(str, line)], check=True, stdout=subprocess.DEVNULL)
            print(folder.name, f"{seconds:.0f} s", flush=True)


if __name__ == "__main__":
    main()
