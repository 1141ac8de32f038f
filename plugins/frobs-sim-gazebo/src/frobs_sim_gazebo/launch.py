"""Runs a Gazebo program in isolation: with a separate network, the installation's root folder, and logs in memory.

This script runs in a separate process and uses only the standard library. Gazebo listens on every network interface. In
a network namespace that contains only the loopback interface, Gazebo cannot be reached from outside, and each server
can use all ports. For users without root privileges, the network namespace is created inside a user namespace.
"""

from __future__ import annotations

import argparse
import ctypes
import fcntl
import os
import socket
import struct
import sys

_NEWNS, _NEWUSER, _NEWNET = 0x00020000, 0x10000000, 0x40000000
_MS_BIND, _MS_REC, _MS_PRIVATE = 4096, 16384, 1 << 18
_SIOCGIFFLAGS, _SIOCSIFFLAGS, _SIOCADDRT = 0x8913, 0x8914, 0x890B
_IFF_UP, _RTF_UP = 1, 1

NO_NAMESPACE = 97
"""Exit status if the kernel does not allow the required namespaces."""


def main() -> None:
    """Run the command given in the command-line arguments. This function does not return."""
    parser = argparse.ArgumentParser()
    parser.add_argument(
        "--root", default="", help="root folder of the Gazebo installation; default: the root folder of this machine"
    )
    parser.add_argument("--network", choices=("own", "host"), default="own")
    parser.add_argument("--scratch", default="", help="mount point of an empty in-memory folder")
    parser.add_argument("command", nargs="+")
    given = parser.parse_args()
    try:
        _wall_off(given.network == "own")
        if given.root:
            _mount("/proc", f"{given.root}/proc", "", _MS_BIND | _MS_REC)
            _mount("/dev", f"{given.root}/dev", "", _MS_BIND | _MS_REC)
            _mount("tmpfs", f"{given.root}/tmp", "tmpfs", 0)
            os.chroot(given.root)
            os.chdir("/")
        elif given.scratch:
            _mount("tmpfs", given.scratch, "tmpfs", 0)
    except OSError as error:
        sys.stderr.write(f"cannot create a namespace for Gazebo: {error}\n")
        sys.exit(NO_NAMESPACE)
    try:
        os.execvp(given.command[0], given.command)
    except OSError as error:
        sys.stderr.write(f"{given.command[0]} cannot be run: {error}\n")
        sys.exit(127)


def _wall_off(own_network: bool) -> None:
    uid, gid = os.geteuid(), os.getegid()
    flags = _NEWNS | (_NEWNET if own_network else 0) | (_NEWUSER if uid else 0)
    _checked(_LIBC.unshare(flags), "unshare")
    if uid:
        for name, text in (("setgroups", "deny"), ("uid_map", f"0 {uid} 1"), ("gid_map", f"0 {gid} 1")):
            with open(f"/proc/self/{name}", "w") as file:
                file.write(text)
    _checked(_LIBC.mount(b"none", b"/", None, _MS_REC | _MS_PRIVATE, None), "mount")
    if own_network:
        _raise_loopback()


def _raise_loopback() -> None:
    """Bring up the loopback interface, and route the multicast messages of Gazebo's discovery to this interface."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as control:
        request = struct.pack("16sh14x", b"lo", 0)
        flags = struct.unpack("16sh14x", fcntl.ioctl(control, _SIOCGIFFLAGS, request))[1]
        fcntl.ioctl(control, _SIOCSIFFLAGS, struct.pack("16sh14x", b"lo", flags | _IFF_UP))
        device = ctypes.create_string_buffer(b"lo")

        def address(dotted: str) -> bytes:
            return struct.pack("hH4s8x", socket.AF_INET, 0, socket.inet_aton(dotted))

        route = b"".join(
            (
                struct.pack("L", 0),
                address("224.0.0.0"),
                address("0.0.0.0"),
                address("240.0.0.0"),
                struct.pack("HhLPhPLLH", _RTF_UP, 0, 0, 0, 0, ctypes.addressof(device), 0, 0, 0),
                bytes(16),
            )
        )
        fcntl.ioctl(control, _SIOCADDRT, route)


def _mount(source: str, target: str, kind: str, flags: int) -> None:
    arguments = (source.encode(), target.encode(), kind.encode() or None, flags, None)
    _checked(_LIBC.mount(*arguments), f"mount {target}")


def _checked(status: int, what: str) -> None:
    if status != 0:
        number = ctypes.get_errno()
        raise OSError(number, f"{what}: {os.strerror(number)}")


_LIBC = ctypes.CDLL(None, use_errno=True)
_LIBC.mount.argtypes = (ctypes.c_char_p, ctypes.c_char_p, ctypes.c_char_p, ctypes.c_ulong, ctypes.c_char_p)

if __name__ == "__main__":
    main()
