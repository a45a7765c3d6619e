"""The command that the wheel brings: the same bytes and exit codes as the program that cargo builds."""

import signal
import subprocess
import sys
import time

import pytest

WHEEL = [sys.executable, "-m", "policyc"]


def both(program, arguments, **options):
    return [subprocess.run([*command, *arguments], capture_output=True, **options) for command in (WHEEL, [program])]


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        (["--help"], 0),
        (["--version"], 0),
        (["compile", "--help"], 0),
        (["targets"], 0),
        (["inspect", "examples/buck12"], 0),
        (["inspect", "examples/buck12", "--json"], 0),
        (["inspect", "examples/nowhere"], 2),
        (["compile", "examples/buck12"], 2),
        (["verifi"], 2),
        ([], 2),
        (["verify", "examples/buck12", "--generated", "tests/golden/buck12", "--drift-only"], None),
    ],
)
def test_bytes_and_exit_codes_are_the_programs(arguments, code, program):
    wheel, native = both(program, arguments)
    assert (wheel.returncode, wheel.stdout, wheel.stderr) == (native.returncode, native.stdout, native.stderr)
    assert code is None or native.returncode == code


def test_a_reader_that_has_seen_enough_is_no_fault(program):
    for command in (WHEEL, [program]):
        run = subprocess.Popen([*command, "inspect", "examples/buck12", "--json"], stdout=subprocess.PIPE)
        run.stdout.close()
        assert run.wait() == 0


def test_an_interrupt_ends_it_with_130(program, tmp_path):
    for name, command in (("wheel", WHEEL), ("program", [program])):
        arguments = ["verify", "examples/buck12", "--steps", "100000000"]
        run = subprocess.Popen([*command, *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        # long enough for Python to have handed over
        time.sleep(2.0)
        run.send_signal(signal.SIGINT)
        out, error = run.communicate(timeout=60)
        assert (run.returncode, out) == (130, b""), name
        assert b"interrupted" in error and b"Traceback" not in error


def test_the_script_of_the_wheel_is_the_command():
    from importlib.metadata import entry_points

    scripts = entry_points()
    found = scripts.select(group="console_scripts") if hasattr(scripts, "select") else scripts["console_scripts"]
    assert [script.value for script in found if script.name == "policyc"] == ["policyc.__main__:main"]
