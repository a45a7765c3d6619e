"""The tutorial and the package's own page: every block of Python runs as it stands."""

import os

import pytest
from pages import is_in, run


@pytest.mark.parametrize("page", ["docs/tutorials/python.md", "python/README.md"])
def test_every_block_of_python_runs(page, root, tmp_path, monkeypatch):
    os.symlink(root, tmp_path / "policyc")
    folder = tmp_path / "here"
    folder.mkdir()
    # the tutorial is read beside the checkout, the package's page in it
    monkeypatch.chdir(folder if page.startswith("docs") else root)
    ran, _ = run(root / page)
    assert ran >= 1


def test_what_is_shown_is_held_against_what_is_printed():
    assert is_in("a ... c\n...\n2", "a b c\nx\n2")
    assert not is_in("2\na ... c", "a b c\n2") and not is_in("a", "ab")
