"""What the tests of the wheel share. `cargo xtask test` builds the wheel, installs it and says where the program is."""

import os
import pathlib

import pytest


@pytest.fixture(scope="session")
def root() -> pathlib.Path:
    """The checkout."""
    return pathlib.Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def program(root: pathlib.Path) -> str:
    """The command as cargo builds it."""
    return os.environ.get("POLICYC_PROGRAM", str(root / "target/debug/policyc"))


@pytest.fixture(autouse=True)
def in_checkout(root: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Paths of the tests start from the checkout."""
    monkeypatch.chdir(root)


# a choice with a mapping, one with losses, a plain one, and a continuous actor
EXAMPLES = ["examples/buck12", "examples/blind/policy", "tests/golden/cases/paper", "tests/golden/cases/continuous"]
OUTPUTS = ["c", "rust", "rust-over-c", "kit", "sfunction", "fmu2", "fmu3"]
