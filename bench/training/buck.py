"""The paper's converter (averaged, 1.5 mF) as a gymnasium environment with as little arithmetic as possible."""

import gymnasium
import numpy as np

DUTIES = [0.44 + 0.01 * n for n in range(12)]
V_IN, V_REF, L, C, T = 200.0, 100.0, 2e-3, 1.5e-3, 1e-4
SUBSTEPS = 10


class Buck(gymnasium.Env):
    """State (v, v_del, dv/dt, e, e_del, de/dt), normalised; reward as in the paper."""

    action_space = gymnasium.spaces.Discrete(len(DUTIES))
    observation_space = gymnasium.spaces.Box(-20.0, 20.0, (6,), np.float32)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.step_count = 0
        self.power = self.np_random.uniform(150.0, 1050.0)
        self.v = self.np_random.uniform(95.0, 105.0)
        self.i = self.power / self.v
        self.v_del = self.v
        return self._observation(), {}

    def _observation(self):
        e, e_del = 0.2 * (self.v - V_REF), 0.2 * (self.v_del - V_REF)
        slope = 3e-4 * (self.i - self.power / self.v) / C
        observation = np.array([e, e_del, slope, -e, -e_del, -slope], dtype=np.float32)
        return np.clip(observation, -20.0, 20.0, out=observation)

    def step(self, action):
        self.v_del = self.v
        v, i, u, dt = self.v, self.i, V_IN * DUTIES[action], T / SUBSTEPS
        for _ in range(SUBSTEPS):
            i += dt * (u - v) / L
            v += dt * (i - self.power / v) / C
        self.v, self.i = max(v, 1.0), max(i, 0.0)
        error = abs(self.v - V_REF)
        reward = (10.0 if error <= 0.1 else 1.0 if error <= 1.0 else 0.0) - 10.0 * error
        self.step_count += 1
        if self.step_count % 100 == 0:
            self.power = self.np_random.uniform(150.0, 1050.0)
        return self._observation(), reward, False, self.step_count >= 400 or error > 50.0, {}
