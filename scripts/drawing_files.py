"""Files of drawings that are complete or absent, and texts that matplotlib draws as they stand, and how wide they are.

For the scripts that draw: whoever ends one while it writes finds the drawing of before, or none.
"""

import errno
import fcntl
import io
import os
import re
import sys
from pathlib import Path

LONGEST_NAME = 255  # bytes; of all usual file systems
ROOM_FOR_ENDING = 24
FONT = "DejaVu Sans"  # of all drawings
MARK = "user.tpm.origin"  # as files/origin_mark.hpp says


def save_drawing(page, path, change=None, reads=(), **options):
    """Writes a figure of matplotlib to `path`, which is complete or as it was before; never over a file that the
    script `reads`, through links neither. What fails ends the script in one line.

    The format follows the ending of `path`. `change` makes of the text of an SVG what is kept.
    """
    path = Path(path)
    drawn = io.BytesIO()
    page.savefig(drawn, format=path.suffix[1:], **options)
    content = drawn.getvalue()
    if change is not None:
        content = change(content.decode("utf-8")).encode("utf-8")
    script = Path(sys.argv[0]).name
    if path.exists() and any(path.samefile(read) for read in reads):
        sys.exit(f"{script}: {path}: this script reads it and would write over it; expected another place")
    try:
        replace_file(path, content)
    except OSError as error:
        sys.exit(f"{script}: {path}: {error.strerror}; expected a file that can be written")


def replace_file(path, content):
    """Writes a file without a name beside `path` and gives it that when complete, as files/replacement.hpp does.

    A symbolic link stays and leads to the new file. Who is killed leaves nothing, or where the name was taken perhaps
    a temporary file, which the next to write there removes.
    """
    path = Path(os.path.realpath(path))
    beginning = path.name if len(path.name.encode()) + ROOM_FOR_ENDING <= LONGEST_NAME else ".tpm-drawing"
    remove_abandoned(path.parent, beginning)
    temporary = path.with_name(f"{beginning}.part.{os.getpid()}")
    try:
        file, named = os.open(path.parent, os.O_TMPFILE | os.O_WRONLY | os.O_CLOEXEC, 0o666), False
    except OSError as error:
        if error.errno not in (errno.EOPNOTSUPP, errno.EISDIR, errno.EINVAL, errno.ENOENT):
            raise
        file, named = os.open(temporary, os.O_CREAT | os.O_EXCL | os.O_WRONLY | os.O_CLOEXEC, 0o666), True
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        with os.fdopen(os.dup(file), "wb") as out:
            out.write(content)
        if path.exists():
            os.fchmod(file, path.stat().st_mode & 0o777)
        os.fsync(file)
        mark(file)
        if not named:
            try:
                link_open(file, path)
                return
            except FileExistsError:
                link_open(file, temporary)
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)
        os.close(file)


def link_open(file, name):
    """Gives an open file a name. Only with a folder's descriptor does os.link() follow /proc to the file."""
    os.link(f"/proc/self/fd/{file}", name, src_dir_fd=file, follow_symlinks=True)


def mark(file):
    """Marks a drawing that tpm asked for with what made it, where the file system has attributes."""
    origin = os.environ.get("TPM_ORIGIN", "")
    if not origin:
        return
    found = os.fstat(file)
    seconds, rest = divmod(found.st_mtime_ns, 10**9)
    try:
        os.setxattr(file, MARK, f"{found.st_size} {seconds}.{rest:09}\n{origin[:3000]}".encode())
    except OSError:
        pass


def remove_abandoned(folder, beginning):
    """Removes temporary files whose writers are dead: a writer that lives holds a lock."""
    for file in folder.iterdir():
        if not re.fullmatch(re.escape(beginning) + r"\.part\.[0-9-]+", file.name):
            continue
        try:
            opened = os.open(file, os.O_RDWR | os.O_CLOEXEC | os.O_NOFOLLOW | os.O_NONBLOCK)
        except OSError:
            continue
        try:
            fcntl.flock(opened, fcntl.LOCK_EX | fcntl.LOCK_NB)
            file.unlink(missing_ok=True)
        except BlockingIOError:
            pass
        finally:
            os.close(opened)


def literal(value):
    """The value with every `$` in its texts drawn as one: two would begin and end a formula of matplotlib."""
    if isinstance(value, str):
        return value.replace("$", r"\$")
    if isinstance(value, list):
        return [literal(item) for item in value]
    if isinstance(value, dict):
        return {key: item if key == "id" else literal(item) for key, item in value.items()}
    return value


def text_width(text, size):
    """Inches of a line of text of `size` points in FONT."""
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import text_to_path
    return text_to_path.get_text_width_height_descent(text, FontProperties(family=[FONT], size=size), False)[0] / 72


def wrapped(parts, size, width, between=" "):
    """Lines no wider than `width` inches, unless a part alone is."""
    lines = []
    for part in parts:
        if lines and text_width(lines[-1] + between + part, size) <= width:
            lines[-1] += between + part
        else:
            lines.append(part)
    return lines
