"""Paths start from the checkout, as in the other tests."""

import pathlib

import pytest


@pytest.fixture(scope="session")
def root() -> pathlib.Path:
    """The checkout."""
    return pathlib.Path(__file__).resolve().parents[3]


@pytest.fixture(autouse=True)
def in_checkout(root: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Paths of the tests start from there."""
    monkeypatch.chdir(root)
