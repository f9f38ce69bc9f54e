"""`tpm`, the program; also `python -m tpmkit`. The wheel brings it along, the Debian package installs it."""

import os
import shutil
import sys
from pathlib import Path


def main() -> None:
    """Runs the program with the arguments of this one, in its place."""
    own = Path(__file__).parent / "bin" / "tpm"
    # Not the script of this name that a wheel puts on the path: that is this function.
    program = str(own) if own.exists() else shutil.which("tpm", path="/usr/bin:/usr/local/bin")
    if program is None:
        sys.exit("tpmkit: the program tpm is not installed; expected the wheel, or the Debian package tpmkit")
    os.execv(program, ["tpm", *sys.argv[1:]])


if __name__ == "__main__":
    main()
