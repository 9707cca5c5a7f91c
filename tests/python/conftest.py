import os
import pathlib
import subprocess

import pytest

SOURCE = pathlib.Path(__file__).resolve().parents[2]
PROGRAM = os.environ["OFFSTAGE"]


@pytest.fixture(scope="session")
def tiny():
    """A scene with bodies, a spring, a ball and a fountain."""
    return SOURCE / "tests/data/tiny.json"


@pytest.fixture(scope="session")
def program():
    def run(*arguments, cwd=None):
        done = subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True, cwd=cwd)
        assert done.returncode == 0, done.stderr
        return done.stdout

    return run
