"""The command ``policyc``, in process: the same bytes and exit codes as the program that cargo installs."""

import sys

from ._policyc import command


def main() -> int:
    """Runs the command line of this process and returns its exit code."""
    # `python -m policyc` would call itself __main__.py in its help
    return command(["policyc", *sys.argv[1:]])


if __name__ == "__main__":
    sys.exit(main())
