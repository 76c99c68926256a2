"""Builds the Debian package of a station: program, service, user, udev rule, capabilities.

    python .ci/supply/debian.py WHEELS OUTPUT

WHEELS is a folder with the wheel of servodeck (the page inside) and of every package of
``.ci/supply/run.txt``, as ``pip download`` or ``pip wheel`` leaves them; nothing is asked of any
index. The wheels are unpacked at build time into ``/opt/servodeck/site``, so that installing
needs no network, no compiler and no pip. The package fits the CPython that builds it.

Installing keeps a running station's state; removing keeps ``/var/lib/servodeck`` and the user,
purging deletes both.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from backend.station.install.service import systemd_unit

PROGRAM = "opt/servodeck"
UNIT = "usr/lib/systemd/system/servodeck.service"
UDEV = "usr/lib/udev/rules.d/60-servodeck.rules"

_LAUNCHER = """\
#!/bin/sh
export PYTHONPATH="${{0%/*}}/../site"
exec python{python} -m backend "$@"
"""
_UDEV = """\
# Serial adapters of the station's user; a CAN or EtherCAT port needs none.
SUBSYSTEM=="tty", SUBSYSTEMS=="usb", GROUP="dialout", MODE="0660"
# FTDI chips hold answers back for 16 ms otherwise.
ACTION=="add", SUBSYSTEM=="usb-serial", DRIVER=="ftdi_sio", ATTR{latency_timer}="1"
"""
#: $DPKG_ROOT is empty, or the folder of a system that is not running (dpkg(1), chrootless).
_AFTER_INSTALL = """\
#!/bin/sh
set -e
# What was to replace or remove it failed: the service that stopped for that goes on.
if [ -z "$DPKG_ROOT" ] && [ -d /run/systemd/system ]; then
    case "$1" in
        abort-remove) systemctl enable --now servodeck.service ;;
        abort-upgrade|abort-deconfigure)
            if systemctl is-enabled --quiet servodeck.service; then
                systemctl start servodeck.service
            fi ;;
    esac
fi
if [ "$1" = configure ]; then
    state="$DPKG_ROOT/var/lib/servodeck"
    mkdir -p "$state"
    chmod 0700 "$state"
    if [ -z "$DPKG_ROOT" ]; then
        getent passwd servodeck >/dev/null || adduser --system --group --quiet \\
            --home /var/lib/servodeck --no-create-home servodeck
        adduser --quiet servodeck dialout
        chown servodeck:servodeck "$state"
        if [ -d /run/systemd/system ]; then
            systemctl daemon-reload
            udevadm control --reload || true
            # For adapters that are plugged in already; their terminals are left alone.
            udevadm trigger --action=add --subsystem-match=usb-serial || true
            systemctl enable servodeck.service
            systemctl restart servodeck.service
        fi
    fi
fi
"""
_BEFORE_REMOVAL = """\
#!/bin/sh
set -e
if [ -z "$DPKG_ROOT" ] && [ -d /run/systemd/system ]; then
    # What moves is braked first (SIGTERM). On an upgrade as well: a running program would load
    # modules of the new version beside those of its own.
    case "$1" in
        remove) systemctl disable --now servodeck.service ;;
        upgrade) systemctl stop servodeck.service ;;
    esac
fi
# What Python compiled while the program ran is not in dpkg's list.
if [ -d "$DPKG_ROOT/opt/servodeck" ]; then
    find "$DPKG_ROOT/opt/servodeck" -name __pycache__ -prune -exec rm -rf {} +
fi
"""
_AFTER_REMOVAL = """\
#!/bin/sh
set -e
if [ "$1" = purge ]; then
    rm -rf "$DPKG_ROOT/var/lib/servodeck"
    # adduser, which has deluser, need not be there any more.
    if [ -z "$DPKG_ROOT" ] && getent passwd servodeck >/dev/null; then
        if command -v deluser >/dev/null; then
            deluser --quiet --system servodeck
        else
            echo "servodeck: the user servodeck stays, as deluser is not installed"
        fi
    fi
elif [ "$1" = remove ]; then
    echo "servodeck: /var/lib/servodeck (drives, measurements, accounts) stays; purging deletes it"
    if [ -z "$DPKG_ROOT" ] && [ -d /run/systemd/system ]; then
        systemctl daemon-reload
    fi
fi
"""
#: An older program does not understand the state of a newer one.
_BEFORE_INSTALL = """\
#!/bin/sh
set -e
if [ "$1" = upgrade ] && dpkg --compare-versions "$2" gt "{version}"; then
    echo "servodeck: version $2 is installed; {version} is older and does not understand its" >&2
    echo "state. Restore a backup made by {version}, or install a newer version." >&2
    exit 1
fi
"""
_CONTROL = """\
Package: servodeck
Version: {version}
Architecture: {architecture}
Maintainer: servodeck <servodeck@servodeck.invalid>
Depends: python{python}, adduser
Section: science
Priority: optional
Description: servo-drive commissioning in a browser
 EtherCAT, CANopen, Modbus RTU and MLink. The station runs as a service of its own
 user, with the capabilities that EtherCAT needs and no others.
"""


def install_wheels(wheels: Path, site: Path) -> None:
    """Unpack all wheels of a folder, without asking an index.

    Raises:
        CalledProcessError: a wheel is missing or does not fit this Python.
    """
    subprocess.run(
        [sys.executable, "-m", "pip", "install", "--quiet", "--no-index", "--no-compile",
         "--disable-pip-version-check", "--find-links", str(wheels), "--target", str(site),
         "servodeck"],
        check=True,
    )  # fmt: skip


def build(site: Path, output: Path, version: str) -> Path:
    """The package with the program in ``site``; returns its file.

    Raises:
        CalledProcessError: dpkg-deb refused.
    """
    python = f"{sys.version_info.major}.{sys.version_info.minor}"
    architecture = subprocess.run(
        ["dpkg", "--print-architecture"], capture_output=True, text=True, check=True
    ).stdout.strip()
    output.mkdir(parents=True, exist_ok=True)
    file = output / f"servodeck_{version}_{architecture}.deb"
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder) / "root"
        shutil.copytree(site, root / PROGRAM / "site")
        known = {"version": version, "architecture": architecture, "python": python}
        _put(root / PROGRAM / "bin/servodeck", _LAUNCHER.format(**known), 0o755)
        _put(root / UNIT, systemd_unit())
        _put(root / UDEV, _UDEV)
        _put(root / "DEBIAN/control", _CONTROL.format(**known))
        _put(root / "DEBIAN/preinst", _BEFORE_INSTALL.format(**known), 0o755)
        _put(root / "DEBIAN/postinst", _AFTER_INSTALL, 0o755)
        _put(root / "DEBIAN/prerm", _BEFORE_REMOVAL, 0o755)
        _put(root / "DEBIAN/postrm", _AFTER_REMOVAL, 0o755)
        link = root / "usr/bin/servodeck"
        link.parent.mkdir(parents=True)
        _put(link, f'#!/bin/sh\nexec /{PROGRAM}/bin/servodeck "$@"\n', 0o755)
        subprocess.run(
            ["dpkg-deb", "--root-owner-group", "-Zgzip", "-z1", "--build", str(root), str(file)],
            check=True,
            capture_output=True,
        )
    return file


def _put(file: Path, text: str, mode: int = 0o644) -> None:
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text, "utf-8")
    file.chmod(mode)


def main(arguments: list[str]) -> int:
    """Build from a folder of wheels."""
    wheels, output = Path(arguments[0]), Path(arguments[1])
    ours = next(wheels.glob("servodeck-*.whl"))
    with tempfile.TemporaryDirectory() as folder:
        site = Path(folder) / "site"
        install_wheels(wheels, site)
        if not (site / "backend/web/index.html").is_file():
            raise SystemExit(f"{ours.name} has no page in it; build it without SERVODECK_NO_PAGE")
        file = build(site, output, ours.name.split("-")[1])
    print(f"{file}: {file.stat().st_size >> 20} MiB")
    return 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
