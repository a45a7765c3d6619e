"""The command ``policyc``, in process: the same bytes and exit codes as the program that cargo installs."""

import sys

from ._policyc import command, on_ray


def main() -> int:
    """Runs the command line of this process and returns its exit code."""
    # `python -m policyc` would call itself __main__.py in its help
    line = ["policyc", *sys.argv[1:]]
    if "campaign" in line:
        from . import campaigns

        asked = on_ray(line)
        return campaigns.from_command(asked) if asked else command(line, campaigns.worker_program())
    return command(line, [])


if __name__ == "__main__":
    sys.exit(main())
