"""Control steps per second of Stable-Baselines3's DQN, behind a warm-up."""

import sys
import time

import torch
from stable_baselines3 import DQN

from buck import Buck

torch.set_num_threads(1)
steps = int(sys.argv[1])
model = DQN(
    "MlpPolicy",
    Buck(),
    learning_rate=1e-3,
    buffer_size=200_000,
    learning_starts=256,
    batch_size=256,
    tau=2e-3,
    gamma=0.9,
    train_freq=1,
    gradient_steps=1,
    target_update_interval=1,
    exploration_fraction=1.0,
    exploration_final_eps=0.1,
    max_grad_norm=1.0,
    policy_kwargs={"net_arch": [64, 64]},
    device="cpu",
    seed=0,
)
model.learn(500)
start = time.perf_counter()
model.learn(steps, reset_num_timesteps=False)
print(f"{steps / (time.perf_counter() - start):.0f}")
