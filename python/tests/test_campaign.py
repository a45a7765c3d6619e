"""Campaigns: the same results from the wheel, the command and the program, whoever ran a task."""

import json
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import time

import pytest
from campaigns import PLAN, contents, desk

import policyc

__all__ = ["desk"]

WHEEL = [sys.executable, "-m", "policyc"]


def test_the_wheel_has_the_bytes_of_the_program(desk, program):
    subprocess.run([program, "campaign", "plan.toml", "--out", "program"], check=True, capture_output=True)
    expected = contents("program")
    found = policyc.campaign("plan.toml", "wheel")
    assert found and found.holds and found.ran == 3 and contents("wheel") == expected
    subprocess.run([*WHEEL, "campaign", "plan.toml", "--out", "command"], check=True, capture_output=True)
    assert contents("command") == expected
    # as data, with paths from here
    assert contents(policyc.campaign(PLAN, "data").out) == expected
    again = policyc.campaign("plan.toml", "wheel")
    assert again.ran == 0 and again.results == found.results


def test_a_result_is_rows_policies_and_a_page(desk):
    found = policyc.campaign("plan.toml", "out")
    assert [row["kind"] for row in found.rows] == ["train", "train", "simulate"]
    assert found.rows[0]["settings"] == "train.toml" and found.rows[0]["seed"] == 1
    assert "<iframe" in found._repr_html_() and "3 of 3 tasks" in str(found)
    policy = policyc.Policy.load(found.best["train.toml"])
    assert policy.name == "paper12" and found.failed == {}
    best = min((row for row in found.rows if row["kind"] == "train"), key=lambda row: row["selection_cost"])
    assert best["id"] == os.path.basename(found.best["train.toml"])


def test_faults_and_failures(desk):
    with pytest.raises(policyc.Faults, match="did you mean `train`"):
        policyc.campaign({"trian": []}, "out")
    with pytest.raises(ValueError, match="local"):
        policyc.campaign("plan.toml", "out", engine="dask")
    with pytest.raises(ValueError, match="address"):
        policyc.campaign("plan.toml", "out", address="auto")
    assert not os.path.exists("out")
    pathlib.Path("empty.csv").write_text("t,duty,v_out\n")
    with pytest.raises(policyc.Faults, match="empty.csv"):
        policyc.campaign({"diagnose": [{"models": "plants/paper-model.toml", "train": "empty.csv"}]}, "out")
    # what only the run finds out: loads that would be resistors
    plant = pathlib.Path("plants/paper-model.toml")
    plant.write_text(plant.read_text() + "\n[load]\nv_fold = 90.0\n")
    found = policyc.campaign({"train": [{"settings": "train.toml", "seeds": 1}]}, "out")
    [reason] = found.failed.values()
    assert not found and "v_fold" in reason


def test_a_task_is_performed_from_bytes_alone(desk):
    """What an engine sends to another machine, without one."""
    from policyc import _policyc

    native = _policyc.NativeCampaign("plan.toml", None, "sent", False)
    native.begin()
    here = os.getcwd()
    for index in reversed(native.pending()):
        kind, arguments, digests = native.shipped(index)
        inputs = {path: native.content(index, path) for path in digests}
        code, files, reason = _policyc.perform(kind, arguments, inputs)
        assert (code, reason, os.getcwd()) == (0, None, here)
        native.store(index, code, files)
    native.finish()
    policyc.campaign("plan.toml", "local")
    assert contents("sent") == contents("local")


def test_what_carries_a_task_takes_less_than_5_ms(desk):
    """Beside the command and what an engine itself takes: reading the task, staging its inputs, collecting and keeping its files. The
    command is the shortest there is. The best of many, because the machine has other work, too."""
    from policyc import _policyc

    policyc.campaign("plan.toml", "out")
    files = contents(next(pathlib.Path("out/tasks").glob("train-*")))
    del files["task.json"]
    native = _policyc.NativeCampaign("plan.toml", None, "other", False)
    native.begin()
    index = native.pending()[0]

    def carry():
        begun = time.perf_counter()
        kind, _, digests = native.shipped(index)
        inputs = {path: native.content(index, path) for path in digests}
        assert _policyc.perform(kind, ["targets"], inputs)[0] == 0
        native.store(index, 0, files)
        return time.perf_counter() - begun

    def command():
        begun = time.perf_counter()
        assert _policyc.perform("train", ["targets"], {})[0] == 0
        return time.perf_counter() - begun

    best, begun = carry(), time.monotonic()
    while best >= 5e-3 and time.monotonic() - begun < 20.0:
        # in a moment that the other work leaves free
        best = min(best, *(carry() for _ in range(40)))
    best = min(best, *(carry() for _ in range(40)))
    print(f"{1e3 * best:.2f} ms, of which {1e3 * min(command() for _ in range(40)):.2f} ms the command in an empty folder")
    assert best < 5e-3


def test_an_interrupt_ends_it_and_the_next_goes_on(desk):
    text = pathlib.Path("train.toml").read_text()
    pathlib.Path("train.toml").write_text(text.replace("steps = 600\n", "steps = 100000\n").replace("every = 200", "every = 50000"))
    # a shell starts what runs in the background with the signal ignored, which is handed on
    heard = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)"
    code = f"{heard}; import policyc; policyc.campaign('plan.toml', 'out', jobs=1)"
    run = subprocess.Popen([sys.executable, "-c", code], stderr=subprocess.PIPE)
    work = pathlib.Path("out/work")
    begun = time.monotonic()
    while not any(work.glob("train-*/out/checkpoints/*")):
        assert run.poll() is None and time.monotonic() - begun < 60
        time.sleep(0.01)
    run.send_signal(signal.SIGINT)
    _, error = run.communicate(timeout=30)
    assert run.returncode != 0 and b"KeyboardInterrupt" in error
    shutil.rmtree(work)


def test_the_command_names_what_the_engine_needs(desk):
    if shutil.which("ray") or os.path.exists(os.path.join(os.path.dirname(sys.executable), "ray")):
        pytest.skip("Ray is installed here")
    run = subprocess.run([*WHEEL, "campaign", "plan.toml", "--out", "out", "--engine", "ray"], capture_output=True, text=True)
    assert run.returncode == 2 and "policyc[ray]" in run.stderr and "Traceback" not in run.stderr
    assert not os.path.exists("out"), "nothing is begun"
    listed = [*WHEEL, "campaign", "plan.toml", "--out", "out", "--engine", "ray", "--list", "--json"]
    run = subprocess.run(listed, capture_output=True, text=True)
    assert [task["done"] for task in json.loads(run.stdout)] == [False] * 3


class NoRay:
    """Ray as far as a test of what becomes of its faults needs it."""

    @staticmethod
    def is_initialized():
        return False

    @staticmethod
    def init(**_):
        raise RuntimeError("a story\nof three lines\nno such cluster")


def test_a_fault_of_ray_is_one_line_and_nothing_is_begun(desk, monkeypatch, capsys):
    from policyc import campaigns

    monkeypatch.setitem(sys.modules, "ray", NoRay)
    asked = (pathlib.Path("plan.toml"), pathlib.Path("out"), "nowhere", [False, True, True])
    assert campaigns.from_command(asked) == 2
    assert capsys.readouterr().err == "error: no cluster of Ray: no such cluster\n"
    assert not os.path.exists("out")


def test_the_answer_of_the_command_is_json_with_the_folder_as_text(desk, monkeypatch, capsys):
    from policyc import campaigns

    policyc.campaign("plan.toml", "out")
    asked = (pathlib.Path("plan.toml"), pathlib.Path("out"), None, [False, True, True])
    assert campaigns.from_command(asked) == 0
    assert json.loads(capsys.readouterr().out)["out"] == "out"


def test_tasks_of_two_threads_do_not_mix_their_folders(desk):
    """The working folder is the process's."""
    from concurrent.futures import ThreadPoolExecutor

    from policyc import _policyc

    native = _policyc.NativeCampaign("plan.toml", None, "out", False)
    here = os.getcwd()

    def perform(index):
        kind, arguments, digests = native.shipped(index)
        return _policyc.perform(kind, arguments, {path: native.content(index, path) for path in digests})

    with ThreadPoolExecutor(4) as pool:
        both = list(pool.map(perform, [2, 2, 2, 2]))
    assert os.getcwd() == here and all(answer == both[0] for answer in both) and both[0][0] == 0
