"""`tpm`, the program; also `python -m tpmkit`. The wheel brings it along, the Debian package installs it."""

import os
import sys

from ._program import found


def main() -> None:
    """Runs the program with the arguments of this one, in its place."""
    program = found()
    if program is None:
        sys.exit("tpmkit: the program tpm is not installed; expected the wheel, or the Debian package tpmkit")
    os.execv(program, ["tpm", *sys.argv[1:]])


if __name__ == "__main__":
    main()
