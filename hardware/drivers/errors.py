"""Errors of real devices: the cause, and what helps."""

from __future__ import annotations

from hardware.errors import HardwareError

RULE = {
    "EV3": 'SUBSYSTEMS=="usb", ATTRS{idVendor}=="0694", ATTRS{idProduct}=="0005", MODE="0666"',
    "lidar": 'SUBSYSTEM=="tty", ATTRS{idVendor}=="15d1", ATTRS{idProduct}=="0000", MODE="0666", SYMLINK+="hokuyo"',
}
"""udev rules that let everybody use the devices; `twin doctor` tells of them too."""


class DeviceError(HardwareError):
    """A device that cannot be used."""

    def __init__(self, device: str, cause: str, remedy: str) -> None:
        super().__init__(f"{device}: {cause}; {remedy}")


class LinkError(DeviceError):
    """A device that does not answer, or not any more."""


def permission(device: str, kind: str) -> DeviceError:
    """The device is there and this user may not use it."""
    rule = f"put the line {RULE[kind]} into /etc/udev/rules.d/99-bricktwin.rules, run `sudo udevadm control --reload`, plug it in again"
    return LinkError(device, "permission denied", rule)
