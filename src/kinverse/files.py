"""Files that are written whole or not at all."""

import os
import tempfile
from pathlib import Path

__all__ = ["write_atomically"]


def write_atomically(path: Path, text: str) -> None:
    """Write a text file: whoever reads it finds the old text or the new one, never a part.

    Args:
        path: in a folder that exists.
        text: written as UTF-8, line ends as they are.

    Raises:
        OSError: the folder is missing or cannot be written.

    Example:
        >>> write_atomically(Path("rows.json"), "[]")
    """
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=path.name, suffix=".part")
    try:
        with os.fdopen(handle, "w", encoding="utf-8", newline="") as file:
            file.write(text)
        # mkstemp makes files that only the owner reads; a result is an ordinary file
        os.chmod(name, 0o666 & ~_umask())
        os.replace(name, path)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
