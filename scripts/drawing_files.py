"""Files of drawings that are complete or absent, and texts that matplotlib draws as they stand.

For the scripts that draw: whoever ends one while it writes finds the drawing of before, or none.
"""

import os
from pathlib import Path

LONGEST_NAME = 255  # bytes; of all usual file systems
ROOM_FOR_ENDING = 24


def save_drawing(page, path, change=None, **options):
    """Writes a figure of matplotlib under a temporary name beside `path` and gives it its own when complete.

    The format follows the ending of `path`. `change` makes of the text of an SVG what is kept.
    """
    path = Path(path)
    beginning = path.name if len(path.name.encode()) + ROOM_FOR_ENDING <= LONGEST_NAME else ".tpm-drawing"
    unfinished = path.with_name(f"{beginning}.part.{os.getpid()}")
    try:
        page.savefig(unfinished, format=path.suffix[1:], **options)
        if change is not None:
            unfinished.write_text(change(unfinished.read_text(encoding="utf-8")), encoding="utf-8")
        unfinished.replace(path)
    finally:
        unfinished.unlink(missing_ok=True)


def literal(value):
    """The value with every `$` in its texts drawn as one: two would begin and end a formula of matplotlib."""
    if isinstance(value, str):
        return value.replace("$", r"\$")
    if isinstance(value, list):
        return [literal(item) for item in value]
    if isinstance(value, dict):
        return {key: item if key == "id" else literal(item) for key, item in value.items()}
    return value
