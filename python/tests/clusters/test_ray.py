"""Campaigns on a cluster of Ray: two nodes on this machine, of which one is killed."""

import os
import pathlib
import subprocess
import sys
import threading
import time

import pytest
import ray
from ray.cluster_utils import Cluster

sys.path.insert(0, os.fspath(pathlib.Path(__file__).resolve().parents[1]))
from campaigns import contents, desk  # noqa: E402

import policyc  # noqa: E402

__all__ = ["desk"]

SEEDS = 64


@pytest.fixture(scope="module")
def started():
    made = Cluster(initialize_head=True, head_node_args={"num_cpus": 1, "include_dashboard": False})
    yield made
    ray.shutdown()
    made.shutdown()


@pytest.fixture
def cluster(started):
    # a test that connects and fails must not hand its connection on
    yield started
    ray.shutdown()


def test_without_a_cluster_one_is_started(desk):
    found = policyc.campaign("plan.toml", "out", engine="ray")
    assert found.holds and not ray.is_initialized()


def test_a_node_is_killed_and_the_result_is_that_of_the_local_engine(desk, cluster):
    second = cluster.add_node(num_cpus=1)
    cluster.wait_for_nodes()
    plan = {"train": [{"settings": "train.toml", "seeds": {"first": 0, "count": SEEDS}}]}
    done = lambda: len(list(pathlib.Path("ray/tasks").glob("*/task.json")))  # noqa: E731
    killed = []

    def kill():
        while done() < SEEDS // 2:
            time.sleep(0.01)
        # as a power cut: the raylet and its workers are gone without a word
        cluster.remove_node(second, allow_graceful=False)
        killed.append(done())

    killer = threading.Thread(target=kill)
    killer.start()
    begun = time.monotonic()
    found = policyc.campaign(plan, "ray", engine="ray", address=cluster.address)
    took = time.monotonic() - begun
    killer.join()
    assert killed and killed[0] < SEEDS, "it was killed in the middle"
    assert found.holds and found.results["counts"]["done"] == SEEDS
    begun = time.monotonic()
    again = policyc.campaign(plan, "ray", engine="ray", address=cluster.address)
    second_run = time.monotonic() - begun
    assert again.ran == 0 and second_run < 5.0
    policyc.campaign(plan, "local")
    assert contents("ray") == contents("local")
    print(f"{SEEDS} trainings on Ray, a node killed after {killed[0]}: {took:.1f} s; a second run: {second_run:.2f} s")


def test_the_command_runs_on_a_cluster(desk, cluster):
    line = [sys.executable, "-m", "policyc", "campaign", "plan.toml", "--out", "out", "--engine", "ray", "--address", cluster.address]
    run = subprocess.run(line, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    assert "3 of 3 tasks are done" in run.stdout and "Traceback" not in run.stderr
    assert contents("out") == contents(policyc.campaign("plan.toml", "local").out)
