"""What cells run on: versions and processor, and the time."""

import os
import platform
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

__all__ = ["machine", "now"]

PACKAGES = ("kinverse", "numpy", "scipy", "scikit-learn", "joblib")


def machine() -> dict[str, str]:
    """Facts by name, as they are shown.

    Example:
        >>> machine()["Python"]
        '3.11.7'
    """
    return {
        **{name: _version(name) for name in PACKAGES},
        "Python": platform.python_version(),
        "system": f"{platform.system()} {platform.machine()}",
        "processor": f"{_processor()}, {os.cpu_count()} cores",
    }


def now() -> str:
    """The time in UTC, to the minute.

    Example:
        >>> now()
        '2026-01-31 17:05'
    """
    return datetime.now(UTC).strftime("%Y-%m-%d %H:%M")


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "not installed"


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        lines = []
    named = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return named[0] if named else platform.processor() or "unknown processor"
