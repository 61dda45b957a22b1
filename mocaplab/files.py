"""Files: an error that names the line, and writing so that nobody ever sees half of one."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path


class FormatError(ValueError):
    """A file that does not keep to its format.

    Attributes
    ----------
    path : str
    line : int or None, counted from 1; None when the whole file is meant
    expected, got : str
    """

    def __init__(self, path: str | os.PathLike[str], line: int | None, expected: str, got: str):
        self.path, self.line, self.expected, self.got = str(path), line, expected, got
        where = self.path if line is None else f"{self.path}:{line}"
        super().__init__(f"{where}: expected {expected}, got {got}")


def check_writable(path: str | os.PathLike[str]) -> None:
    """Refuse a path that cannot become a file, before any long work is done for it.

    Raises
    ------
    OSError
        If it is a folder, a device or a file that may not be written, or the folder that
        it lies in is missing or may not be written.
    """
    path = Path(path)
    if path.is_dir():
        raise IsADirectoryError(f"cannot write {path}: it is a folder")
    if path.exists() and not path.is_file():
        raise OSError(f"cannot write {path}: it is not a regular file")
    if path.exists() and not os.access(path, os.W_OK):
        raise PermissionError(f"cannot write {path}: no permission")
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
    try:
        path = Path(path).resolve()  # a link stays a link; what it points to is replaced
    except RuntimeError:
        raise OSError(f"cannot write {path}: the link points to itself") from None
    check_writable(path)
    data = content.encode() if isinstance(content, str) else content
    handle, temporary = tempfile.mkstemp(prefix=".mocaplab.", dir=path.parent)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
        os.chmod(temporary, _mode_for(path))
        os.replace(temporary, path)
    except BaseException:
        os.unlink(temporary)
        raise


def _mode_for(path: Path) -> int:
    """Return the permissions that a file has, or that a new one gets by the umask."""
    if path.exists():
        return path.stat().st_mode & 0o777
    umask = os.umask(0)
    os.umask(umask)
    return 0o666 & ~umask
