"""Write files so that nobody ever sees half of one."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path


def check_writable(path: str | os.PathLike[str]) -> None:
    """Refuse a path that cannot become a file, before any long work is done for it.

    Raises
    ------
    OSError
        If it is a folder, or the folder that it lies in is missing or may not be written.
    """
    path = Path(path)
    if path.is_dir():
        raise IsADirectoryError(f"cannot write {path}: it is a folder")
    if not path.parent.is_dir():
        raise FileNotFoundError(f"cannot write {path}: there is no folder {path.parent}")
    if not os.access(path.parent, os.W_OK):
        raise PermissionError(f"cannot write {path}: no permission for folder {path.parent}")


def write_atomically(path: str | os.PathLike[str], content: str | bytes) -> None:
    """Write a file under a temporary name, then move it into place.

    Raises
    ------
    OSError
        If the file cannot be written; an older file of that name is then unharmed.
    """
    path = Path(path).resolve()  # a link stays a link, and what it points to is replaced
    check_writable(path)
    data = content.encode() if isinstance(content, str) else content
    handle, temporary = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
        umask = os.umask(0)
        os.umask(umask)
        os.chmod(temporary, 0o666 & ~umask)  # mkstemp makes files that only we may read
        os.replace(temporary, path)
    except BaseException:
        os.unlink(temporary)
        raise
