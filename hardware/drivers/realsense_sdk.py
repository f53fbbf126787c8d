"""The vendor's library of the RealSense cameras, loaded when a camera is opened."""

from __future__ import annotations

import ctypes
import importlib
from types import ModuleType

from hardware.drivers.errors import DeviceError

INSTALL = "pip install 'bricktwin[realsense]'"


def load_sdk() -> ModuleType:
    """`pyrealsense2`; where the system has no libusb, with the one of the package libusb-package.

    Raises:
        DeviceError: it is not installed.
    """
    try:
        return importlib.import_module("pyrealsense2")
    except ImportError as error:
        _load_libusb(error)
    try:
        return importlib.import_module("pyrealsense2")
    except ImportError as error:
        raise DeviceError("camera", f"the vendor's library cannot be loaded ({error})", INSTALL) from error


def _load_libusb(error: ImportError) -> None:
    """Bring the library in that the vendor's wheel looks for and does not carry."""
    if isinstance(error, ModuleNotFoundError):
        raise DeviceError("camera", "the package pyrealsense2 is missing", INSTALL) from error
    try:
        path = importlib.import_module("libusb_package").get_library_path()
    except ImportError as missing:
        raise DeviceError("camera", f"the vendor's library cannot be loaded ({error})", INSTALL) from missing
    ctypes.CDLL(str(path), ctypes.RTLD_GLOBAL)
