"""Policies: loading, faults, and the same bytes as the command."""

import pathlib
import re
import shutil
import subprocess

import pytest
from conftest import EXAMPLES, OUTPUTS

import policyc


def contents(folder: pathlib.Path) -> dict:
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


@pytest.mark.parametrize("example", EXAMPLES)
def test_every_output_has_the_bytes_of_the_command(example, program, tmp_path):
    out = tmp_path / "out"
    emit = ",".join(OUTPUTS)
    command = [program, "compile", example, "--emit", emit, "--no-costs", "--out", str(out)]
    subprocess.run(command, check=True, capture_output=True)
    expected = contents(out)
    found = policyc.Policy.load(example).compile(emit=OUTPUTS, costs=False)
    assert sorted(found) == sorted(expected)
    assert {name for name in expected if found[name] != expected[name]} == set()


def test_costs_and_format_and_target_are_those_of_the_command(program, tmp_path):
    out = tmp_path / "out"
    options = ["--target", "cortex-m4f", "--format", "i16", "--golden-decisions", "0.4", "--clock", "168MHz"]
    command = [program, "compile", "examples/buck12", *options, "--out", str(out)]
    subprocess.run(command, check=True, capture_output=True)
    policy = policyc.Policy.load("examples/buck12")
    assert policy.compile("cortex-m4f", "c", "i16", golden_decisions=0.4, clock="168MHz") == contents(out)


def test_an_inspection_says_what_the_contract_says():
    found = policyc.Policy.load("examples/buck12").inspect()
    assert (found.name, found.sample_period, found.numeric_format) == ("buck12", 1e-4, "f32")
    assert [signal.name for signal in found.signals] == ["v_out", "i_l", "i_out"]
    assert found.signals[1] == policyc.Signal("i_l", "A", (-5.0, 60.0))
    assert found.features[0] == policyc.Feature("e", "v_ref - v_out", 0.2, 0.0, (-20.0, 20.0))
    assert [(layer.inputs, layer.outputs, layer.activation) for layer in found.layers][-1][1:] == (12, "identity")
    assert found.duties == [round(0.44 + 0.01 * n, 2) for n in range(12)]
    assert "buck12" in str(found)


def test_a_fault_comes_with_its_place_and_a_caret(tmp_path):
    shutil.copytree("examples/buck12", tmp_path / "policy")
    contract = tmp_path / "policy/policy.toml"
    text = contract.read_text().replace("hold = 3 ", 'hold = "three" ')
    contract.write_text(text)
    [line] = [number for number, line in enumerate(text.splitlines(), 1) if line.startswith('hold = "three"')]
    with pytest.raises(ValueError, match=r"\^\^\^\^") as caught:
        policyc.Policy.load(tmp_path / "policy")
    assert isinstance(caught.value, policyc.Faults)
    [fault] = caught.value.faults
    assert (fault.file, fault.line, fault.column, fault.length) == (str(contract), line, 8, 7)
    assert "three" in fault.found or "three" in fault.problem
    assert str(fault).strip() in str(caught.value)


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda policy: policy.compile(target="cortex-m4"), "cortex-m4f"),
        (lambda policy: policy.compile(emit="cpp"), "one of c, rust"),
        (lambda policy: policy.compile(format="f16"), "one of f32"),
        (lambda policy: policy.compile(clock="fast"), "168MHz"),
        (lambda policy: policy.certify(axis=["v_ouz", "i_l"]), "v_out"),
    ],
)
def test_a_name_that_is_none_is_said_with_those_there_are(call, said):
    with pytest.raises(policyc.Faults, match=said):
        call(policyc.Policy.load("examples/buck12"))


def test_what_the_command_refuses_is_refused():
    with pytest.raises(policyc.Faults, match="golden decisions|decisions"):
        policyc.Policy.load("examples/buck12").compile(format="i8", golden_decisions=0.0)


def test_verify_finds_all_builds_equal_and_says_so():
    found = policyc.Policy.load("examples/buck12").verify(steps=300)
    assert found and found.equal
    outcomes = {build["outcome"]["result"] for build in found.builds}
    assert "equal" in outcomes and outcomes <= {"equal", "skipped"}
    assert found.checksum and "equal" in str(found).lower()


def test_a_trace_with_other_columns_is_read_by_a_map(tmp_path):
    policy = policyc.Policy.load("examples/buck12")
    signals = [signal.name for signal in policy.inspect().signals]
    rows = [",".join(f"CH{index}" for index, _ in enumerate(signals)), ",".join("1" for _ in signals)]
    trace = tmp_path / "scope.csv"
    trace.write_text("\n".join(rows) + "\n")
    with pytest.raises(policyc.Faults, match=signals[0]):
        policy.verify(steps=10, traces=[trace])
    columns = {name: f"CH{index}" for index, name in enumerate(signals)}
    assert policy.verify(steps=10, traces=[trace], map=columns).equal


def test_verify_names_a_folder_that_has_drifted(tmp_path):
    policy = policyc.Policy.load("examples/buck12")
    for name, content in policy.compile(costs=False).items():
        (tmp_path / name).write_bytes(content)
    assert policy.verify(generated=tmp_path, steps=200).equal
    source = tmp_path / "buck12.c"
    source.write_bytes(source.read_bytes().replace(b"0.2f", b"0.3f", 1))
    found = policy.verify(generated=tmp_path, steps=200)
    assert not found.equal and "buck12.c" in str(found)


def test_generated_code_is_verified_in_its_own_format(tmp_path):
    policy = policyc.Policy.load("examples/buck12")
    for name, content in policy.compile(format="i16", costs=False, golden_decisions=0.4).items():
        (tmp_path / name).write_bytes(content)
    found = policy.verify(generated=tmp_path, steps=200, golden_decisions=0.4)
    assert found.equal, str(found)


def without_command(page):
    """A page of the command says how it was made; one of the module has only the places where that would stand."""
    places = r'<section id="made">.*?</section>\n|<a href="#made">[^<]*</a>\n|<!--how it was made-->\n|<!--its command-->\n'
    return re.sub(places, "", page, flags=re.DOTALL)


def test_certify_gives_the_files_of_the_command(program, tmp_path):
    options = ["--format", "i16", "--samples", "20", "--boxes", "20"]
    command = [program, "certify", "examples/buck12", *options, "--out", str(tmp_path / "out")]
    subprocess.run(command, check=True, capture_output=True)
    found = policyc.Policy.load("examples/buck12").certify(format="i16", samples=20, boxes=20)
    page = (tmp_path / "out/certificate.html").read_text(encoding="utf-8")
    assert 'id="made"' in page and 'id="made"' not in found.html
    assert without_command(found.html) == without_command(page)
    assert found.svg.encode() == (tmp_path / "out/map.svg").read_bytes()
    assert found.json and found.summary and "<iframe" in found._repr_html_()
