"""The Debian package is installed, upgraded, removed and purged by dpkg in a root of its own."""

from __future__ import annotations

import importlib.util
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from backend.station.install.service import systemd_unit

ROOT = Path(__file__).resolve().parents[3]
_SPEC = importlib.util.spec_from_file_location("debian", ROOT / ".ci/supply/debian.py")
assert _SPEC is not None
assert _SPEC.loader is not None
debian = importlib.util.module_from_spec(_SPEC)
_SPEC.loader.exec_module(debian)

pytestmark = pytest.mark.skipif(shutil.which("dpkg-deb") is None, reason="no dpkg here")


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """servodeck itself, from a wheel; the packages that it needs are those of this Python."""
    folder = Path(tmp_path_factory.mktemp("site"))
    subprocess.run(
        [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)],
        cwd=ROOT,
        check=True,
        capture_output=True,
        env={"SERVODECK_NO_PAGE": "1", "PATH": "/usr/bin:/bin"},
    )
    (wheel,) = folder.glob("servodeck-*.whl")
    with zipfile.ZipFile(wheel) as packed:
        packed.extractall(folder / "site")
    return folder / "site"


class Root:
    """A system that is not running, with dpkg's own database."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        (folder / "var/lib/dpkg").mkdir(parents=True)
        (folder / "var/lib/dpkg/status").touch()

    def dpkg(self, *arguments: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            ["dpkg", f"--root={self.folder}", f"--log={self.folder}/log",
             "--force-script-chrootless", "--force-depends", "--force-not-root",
             "--force-bad-path", *arguments],
            capture_output=True, text=True, check=False,
        )  # fmt: skip

    def done(self, *arguments: str) -> str:
        result = self.dpkg(*arguments)
        assert result.returncode == 0, result.stderr
        return result.stdout + result.stderr


PROGRAMS = ("systemctl", "udevadm", "getent", "adduser", "deluser", "chown")


def scripted(tmp_path: Path, script: str, *arguments: str, here: tuple[str, ...]) -> list[str]:
    """What a maintainer's script does on a running system: its calls, none carried out."""
    programs, calls = tmp_path / "programs", tmp_path / "calls"
    shutil.rmtree(programs, ignore_errors=True)
    programs.mkdir()
    calls.write_text("")
    for name in here:
        stand_in = programs / name
        stand_in.write_text(f'#!/bin/sh\necho "{name} $*" >> {calls}\n')
        stand_in.chmod(0o755)
    for name in ("find", "mkdir", "chmod", "rm"):
        (programs / name).symlink_to(shutil.which(name) or name)
    system = tmp_path / "system"
    (system / "run/systemd/system").mkdir(parents=True, exist_ok=True)
    absolute = script.replace("/run/systemd", f"{system}/run/systemd")
    absolute = absolute.replace("$DPKG_ROOT/", f"{system}/")
    done = subprocess.run(
        ["/bin/sh", "-c", absolute, "script", *arguments],
        env={"PATH": str(programs)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return calls.read_text().splitlines()


def test_an_upgrade_stops_the_program_before_its_files_are_replaced(tmp_path: Path) -> None:
    """It imports modules when they are needed: half of them would be of the new version."""
    stopped = scripted(tmp_path, debian._BEFORE_REMOVAL, "upgrade", "0.3.0", here=PROGRAMS)
    assert stopped == ["systemctl stop servodeck.service"]
    started = scripted(tmp_path, debian._AFTER_INSTALL, "configure", "0.2.0", here=PROGRAMS)
    assert started[-1] == "systemctl restart servodeck.service"
    assert "udevadm trigger --action=add --subsystem-match=usb-serial" in started


@pytest.mark.parametrize(
    ("why", "started"),
    [("abort-upgrade", "start"), ("abort-remove", "enable --now"), ("abort-deconfigure", "start")],
)
def test_after_a_refused_downgrade_the_station_runs_again(
    tmp_path: Path, why: str, started: str
) -> None:
    calls = scripted(tmp_path, debian._AFTER_INSTALL, why, "0.1.0", here=PROGRAMS)
    assert calls[-1] == f"systemctl {started} servodeck.service"


def test_removing_works_where_its_folder_or_deluser_is_gone(tmp_path: Path) -> None:
    removed = scripted(tmp_path, debian._BEFORE_REMOVAL, "remove", here=PROGRAMS)
    assert removed == ["systemctl disable --now servodeck.service"]
    assert scripted(tmp_path, debian._AFTER_REMOVAL, "remove", here=PROGRAMS) == [
        "systemctl daemon-reload"
    ]
    assert "deluser --quiet --system servodeck" in scripted(
        tmp_path, debian._AFTER_REMOVAL, "purge", here=PROGRAMS
    )
    few = tuple(name for name in PROGRAMS if name != "deluser")
    assert scripted(tmp_path, debian._AFTER_REMOVAL, "purge", here=few) == [
        "getent passwd servodeck"
    ]


def test_from_installing_to_purging(tmp_path: Path, site: Path) -> None:
    first, second = (debian.build(site, tmp_path, version) for version in ("0.1.0", "0.2.0"))
    root = Root(tmp_path / "root")
    root.done("--install", str(first))
    state = root.folder / "var/lib/servodeck"
    assert state.stat().st_mode & 0o777 == 0o700
    assert (root.folder / debian.UNIT).read_text() == systemd_unit()
    launched = subprocess.run(
        [root.folder / "opt/servodeck/bin/servodeck", "station", "unit"],
        capture_output=True,
        text=True,
        check=False,
        cwd=tmp_path,
        env={"PATH": f"{Path(sys.executable).parent}:/usr/bin:/bin"},
    )
    assert launched.stdout == systemd_unit(), launched.stderr

    (state / "bench.json").write_text("{}")
    root.done("--install", str(second))
    assert (state / "bench.json").read_text() == "{}"

    refused = root.dpkg("--install", str(first))
    assert refused.returncode != 0
    assert "0.1.0 is older and does not understand its" in refused.stderr
    assert "0.2.0" in root.done("--status", "servodeck")

    assert "/var/lib/servodeck" in root.done("--remove", "servodeck")
    assert (state / "bench.json").exists()
    assert not (root.folder / "opt/servodeck").exists()
    root.done("--purge", "servodeck")
    assert not state.exists()
