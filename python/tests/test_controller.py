"""The interpreter: held against the generated C, which gcc compiles here."""

import ctypes
import subprocess

import numpy as np
import pytest

import policyc

STEPS = 5000


class Measurement(ctypes.Structure):
    _fields_ = [(name, ctypes.c_float) for name in ("v_out", "i_l", "i_out")]


class Command(ctypes.Structure):
    _fields_ = [
        ("duty", ctypes.c_float),
        ("duty_sim", ctypes.c_float),
        ("action_index", ctypes.c_uint32),
        ("status", ctypes.c_uint32),
    ]


def measurements() -> np.ndarray:
    """Around the operating point and beyond the ends of the ranges, as binary32 and some that are no numbers."""
    draws = np.random.default_rng(7)
    table = draws.normal([100.0, 10.0, 10.0], [15.0, 12.0, 8.0], size=(STEPS, 3)).astype(np.float32)
    table[draws.random(table.shape) < 0.01] = np.nan
    return table


@pytest.fixture(scope="module")
def compiled(root, tmp_path_factory):
    folder = tmp_path_factory.mktemp("buck12")
    for name, content in policyc.Policy.load(root / "examples/buck12").compile(costs=False).items():
        (folder / name).write_bytes(content)
    library = folder / "buck12.so"
    subprocess.run(["gcc", "-O2", "-shared", "-fPIC", "-ffp-contract=off", "-o", library, folder / "buck12.c"], check=True)
    return ctypes.CDLL(str(library))


def test_steps_have_the_bits_of_the_generated_code(compiled):
    table = measurements()
    state, command = ctypes.create_string_buffer(4096), Command()
    compiled.buck12_init(state)
    expected = []
    for row in table:
        compiled.buck12_step(state, ctypes.byref(Measurement(*map(float, row))), ctypes.byref(command))
        expected.append((command.duty, command.duty_sim, command.action_index, command.status))
    batch = policyc.Controller("examples/buck12").step_batch(table)
    found = list(zip(batch.duty, batch.duty_sim, batch.action_index, batch.status))
    assert found == expected
    single = policyc.Controller("examples/buck12")
    steps = [single.step(row) for row in table[:500]]
    assert [(s.duty, s.duty_sim, s.action_index, s.status) for s in steps] == expected[:500]
    # both ways of it have been seen
    status = np.bitwise_or.reduce(batch.status)
    for bit in (policyc.Status.HELD, policyc.Status.FALLBACK, policyc.Status.PRIMED):
        assert status & bit, bit


def test_outputs_and_observations_come_with_a_batch():
    table = measurements()[:100]
    batch, single = policyc.Controller("examples/buck12"), policyc.Controller("examples/buck12")
    steps = batch.step_batch(table)
    assert steps.observation.shape == (100, 6) and steps.outputs.shape == (100, 12)
    for row, observation, outputs in zip(table, steps.observation, steps.outputs):
        single.step(row)
        assert (single.observation == observation).all() and (single.outputs == outputs).all()
    assert (batch.state_words == single.state_words).all()
    assert (steps.outputs.argmax(axis=1) == steps.action_index)[np.isfinite(table).all(axis=1)].all()


def test_names_rows_and_frames_are_the_same_measurements():
    pandas = pytest.importorskip("pandas")
    table = measurements()[:50]
    frame = pandas.DataFrame(table[:, ::-1], columns=["i_out", "i_l", "v_out"])
    one, other = policyc.Controller("examples/buck12"), policyc.Controller("examples/buck12")
    assert (one.step_batch(frame).duty == other.step_batch(table).duty).all()
    by_name = one.step({"i_out": 9.5, "v_out": 99.0, "i_l": 10.0})
    by_row = other.step([99.0, 10.0, 9.5])
    assert (by_name.duty, by_name.status) == (by_row.duty, by_row.status)


def test_a_reset_controller_starts_anew():
    controller = policyc.Controller("examples/buck12", format="i16")
    first = controller.step([95.0, 10.0, 9.0])
    assert first.status & policyc.Status.PRIMED
    assert not controller.step([95.0, 10.0, 9.0]).status & policyc.Status.PRIMED
    controller.reset()
    assert controller.step([95.0, 10.0, 9.0]).status == first.status


def test_f64_takes_numbers_as_they_are():
    command = policyc.Controller("tests/golden/cases/continuous", format="f64").step([11.9, 4.0])
    assert command.duty_sim != float(np.float32(command.duty_sim))


def test_measurements_of_another_shape_are_refused():
    controller = policyc.Controller("examples/buck12")
    with pytest.raises(policyc.Faults, match="v_out, i_l, i_out"):
        controller.step([1.0, 2.0])
    with pytest.raises(policyc.Faults, match="v_out, i_l, i_out"):
        controller.step_batch(np.zeros((3, 4)))
    with pytest.raises(policyc.Faults, match="i_out"):
        controller.step({"v_out": 1.0, "i_l": 2.0})
    with pytest.raises(TypeError):
        controller.step(["a", "b", "c"])


def test_a_code_of_a_converter_is_a_whole_number():
    controller = policyc.Controller("tests/golden/cases/adc_mapping")
    numbers = [1000.0] * len(controller.signals)
    controller.step(numbers)
    with pytest.raises(policyc.Faults, match="whole number"):
        controller.step([0.5, *numbers[1:]])


def test_coefficients_of_a_mapping_are_set_within_what_the_contract_allows():
    controller = policyc.Controller("examples/buck12")
    before = controller.step([99.0, 10.0, 9.5]).duty
    assert not controller.set_mapping(50.0, 0.0, 0.0)
    assert controller.set_mapping(1.02, 0.0, 0.0)
    assert controller.step([99.0, 10.0, 9.5]).duty != before
