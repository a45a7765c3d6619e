"""The tutorial with the library that trains."""

import os
import sys


def test_the_whole_tutorial_runs(root, tmp_path, monkeypatch):
    sys.path.insert(0, str(root / "python/tests"))
    import pages

    os.symlink(root, tmp_path / "policyc")
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    ran, left_out = pages.run(root / "docs/tutorials/python.md")
    assert (left_out, (tmp_path / "here/policy/policy.toml").is_file()) == (0, True)
