"""From the files of `make packages` to the page on a fresh account: steps and seconds of each way.

    python -m benchmarks.install [DIST]

Everything is installed into scratch folders, without the network where this process may take it
away (``unshare --net``). A way that cannot be gone on this computer states the reason; no figure is
made up. Aims (issue 23): pipx 2 min, Debian package 1 min, unpacked folder 10 s, its cold start 5
s.
"""

from __future__ import annotations

import importlib.util
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import psutil

from benchmarks._aims import Aim, print_verdict
from tests.support.contained import Recipe
from tests.support.installed import NoServer, plain_environment, served

ROOT = Path(__file__).resolve().parents[1]
DIST = ROOT / "dist"
_CACHES = Path("/proc/sys/vm/drop_caches")


class NotHere(Exception):
    """This way cannot be gone on this computer, and why."""


class WayFailed(Exception):
    """A step of this way failed, which counts as an aim that was not met."""


@dataclass(frozen=True)
class Step:
    """What a person types, how long it took, and how long a processor worked for it (seconds)."""

    typed: str
    seconds: float
    processor_s: float


@dataclass
class Walk:
    """One way in, step by step."""

    scratch: Path
    offline: bool
    steps: list[Step] = field(default_factory=list)

    def do(self, typed: str, command: Sequence[str | Path], **environment: str) -> None:
        """One step that installs, without a network where that can be had.

        Raises:
            WayFailed: the command ended with another exit code than 0.
        """
        away = ["unshare", "--net"] if self.offline else []
        began, worked = time.monotonic(), _processor_s()
        done = subprocess.run(
            [*away, *(str(part) for part in command)],
            cwd=self.scratch,
            env=plain_environment(self.scratch / "home") | environment,
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode:
            printed = (done.stderr or done.stdout).strip().splitlines()
            reason = printed[-1] if printed else "no message"
            raise WayFailed(f"{typed}: exit code {done.returncode}: {reason}")
        self.steps.append(Step(typed, time.monotonic() - began, _processor_s() - worked))

    def page(self, typed: str, *command: str | Path, path: Path | None = None) -> None:
        """Start the server and get its page with everything that it names.

        Raises:
            WayFailed: the server did not start, or did not serve its page.
        """
        environment = plain_environment(self.scratch / "home", *([path] if path else []))
        try:
            with served(command, self.scratch, environment) as answer:
                self.steps.append(Step(typed, answer.seconds, answer.processor_s))
        except (NoServer, OSError, psutil.Error) as error:
            raise WayFailed(f"{typed}: {error}") from error

    @property
    def seconds(self) -> float:
        """All steps together."""
        return sum(step.seconds for step in self.steps)


def _processor_s() -> float:
    """Processor time of all processes that this one has started and that have ended."""
    used = os.times()
    return used.children_user + used.children_system


def pip(walk: Walk, dist: Path) -> None:
    """What pipx does: an environment of its own, and pip."""
    environment = walk.scratch / "environment"
    walk.do("python3 -m venv servodeck", [sys.executable, "-m", "venv", environment])
    walk.do(
        "servodeck/bin/pip install --no-index --find-links wheels servodeck",
        [environment / "bin/pip", "install", "--quiet", "--disable-pip-version-check",
         "--no-index", "--find-links", dist / "wheels", "servodeck"],
    )  # fmt: skip
    walk.page("servodeck serve", environment / "bin/servodeck", "serve", "--port", "0")


def uv(walk: Walk, dist: Path) -> None:
    """uv itself, with its tool folder in the scratch folder."""
    if importlib.util.find_spec("uv") is None:
        raise NotHere("uv is not installed here")
    tools, binaries = walk.scratch / "tools", walk.scratch / "bin"
    walk.do(
        "uv tool install --no-index --find-links wheels servodeck",
        [sys.executable, "-m", "uv", "tool", "install", "--quiet", "--offline", "--no-index",
         "--find-links", dist / "wheels", "--python", sys.executable, "servodeck"],
        UV_TOOL_DIR=str(tools), UV_TOOL_BIN_DIR=str(binaries),
        UV_CACHE_DIR=str(walk.scratch / "cache"),
    )  # fmt: skip
    walk.page("servodeck serve", binaries / "servodeck", "serve", "--port", "0")


def debian(walk: Walk, dist: Path) -> None:
    """dpkg in a root of its own; service, user and udev are not started there."""
    walk.page(
        "systemctl start servodeck (here: its program)",
        debian_program(walk, dist),
        "serve",
        "--port",
        "0",
        path=Path(sys.base_prefix) / "bin",
    )


def debian_program(walk: Walk, dist: Path) -> Path:
    """The program of the Debian package, installed in a root of its own."""
    if shutil.which("dpkg") is None:
        raise NotHere("no dpkg on this computer")
    file, root = _one(dist, "servodeck_*.deb"), walk.scratch / "root"
    (root / "var/lib/dpkg").mkdir(parents=True)
    (root / "var/lib/dpkg/status").touch()
    walk.do(
        f"sudo dpkg --install {file.name}",
        ["dpkg", f"--root={root}", f"--log={root}/log", "--force-script-chrootless",
         "--force-depends", "--force-not-root", "--force-bad-path", "--install", file],
    )  # fmt: skip
    return root / "opt/servodeck/bin/servodeck"


def folder(walk: Walk, dist: Path) -> None:
    """The self-contained folder."""
    file = _one(dist, "servodeck-*-linux-*.tar.gz")
    walk.do(f"tar -xzf {file.name}", ["tar", "-xzf", file])
    (unpacked,) = walk.scratch.glob("servodeck-*-linux-*")
    _forget_cached_files()
    walk.page("./servodeck serve, cold", unpacked / "servodeck", "serve", "--port", "0")


def container(walk: Walk, dist: Path) -> None:
    """The image that the Containerfile describes; its root is started in namespaces, not by an
    engine, with the capabilities that it declares and no others.
    """
    if shutil.which("unshare") is None or os.geteuid():
        raise NotHere("its root is started by the superuser with unshare (util-linux)")
    recipe = Recipe.read((ROOT / ".ci/supply/Containerfile").read_text("utf-8"))
    for pattern, _ in recipe.adds:
        _one(dist, Path(pattern).name)
    state = walk.scratch / "state"
    state.mkdir()
    walk.page(
        "podman run servodeck serve (here: its root, in namespaces)",
        *recipe.started(_image(walk, dist, recipe), state, "serve", "--port", "0"),
    )


def _image(walk: Walk, dist: Path, recipe: Recipe) -> Path:
    """Root folder of the image, by buildah or laid out as the Containerfile says."""
    if shutil.which("buildah") is None:
        root, began, worked = walk.scratch / "image", time.monotonic(), os.times()
        recipe.unpack(dist.parent, root)
        used = os.times().user + os.times().system - worked.user - worked.system
        walk.steps.append(
            Step("podman build (here: its ADD lines)", time.monotonic() - began, used)
        )
        return root
    buildah = ["buildah", "--storage-driver", "vfs", "--root", walk.scratch / "storage",
               "--runroot", walk.scratch / "running"]  # fmt: skip
    walk.do(
        "podman build -f .ci/supply/Containerfile -t servodeck .",
        [*buildah, "bud", "--quiet", "--isolation", "chroot", "--tag", "servodeck",
         "-f", ROOT / ".ci/supply/Containerfile", dist.parent],
    )  # fmt: skip
    made = subprocess.run(
        [str(part) for part in (*buildah, "from", "servodeck")],
        capture_output=True,
        text=True,
        check=True,
    )
    mounted = subprocess.run(
        [str(part) for part in (*buildah, "mount", made.stdout.strip())],
        capture_output=True,
        text=True,
        check=True,
    )
    return Path(mounted.stdout.strip())


def edge_box(walk: Walk, dist: Path) -> None:
    """The Debian package, then by commands what a person types on the page."""
    program, state = debian_program(walk, dist), walk.scratch / "state"
    path = f"{Path(sys.base_prefix) / 'bin'}:/usr/bin:/bin"
    walk.do(
        "page: code, administrator, password (here: servodeck people add)",
        [program, "people", "add", "Anna", "--role", "administrator", "--config", state],
        PATH=path,
        SERVODECK_PASSWORD="eleven blue horses",
    )
    walk.do(
        "page: name and ports (here: servodeck station set-up)",
        [program, "station", "set-up", "--name", "cabinet-3", "--config", state],
        PATH=path,
    )
    walk.page(
        "the page asks for the log-in", program, "serve", "--port", "0", "--config", state,
        path=Path(sys.base_prefix) / "bin",
    )  # fmt: skip


def _one(folder_of: Path, pattern: str) -> Path:
    found = sorted(folder_of.glob(pattern))
    if not found:
        raise NotHere(f"no {pattern} in {folder_of.name}/: make packages")
    return found[-1]


def _forget_cached_files() -> None:
    """Read everything from the disk again, where this process may ask for it."""
    os.sync()
    if os.access(_CACHES, os.W_OK):
        _CACHES.write_text("3")


def may_take_network_away() -> bool:
    """Whether a step can be run in an empty network namespace."""
    if shutil.which("unshare") is None:
        return False
    return (
        subprocess.run(["unshare", "--net", "true"], check=False, capture_output=True).returncode
        == 0
    )


WAYS: dict[str, tuple[Callable[[Walk, Path], None], float | None]] = {
    "pipx (venv and pip)": (pip, 120.0),
    "uv tool": (uv, 120.0),
    "Debian package": (debian, 60.0),
    "self-contained folder": (folder, None),
    "container": (container, None),
    "edge box": (edge_box, 60.0),
}
"""How each is gone, and in how many seconds from file to page."""


def main() -> int:
    """Go each way and print its steps; 0 where all aims are met."""
    dist = Path(sys.argv[1]).resolve() if len(sys.argv) > 1 else DIST
    offline = may_take_network_away()
    print(
        f"installing {'without' if offline else 'with (it cannot be taken away here)'} network; "
        f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores"
    )
    aims = []
    for name, (go, aim_s) in WAYS.items():
        with tempfile.TemporaryDirectory(prefix="servodeck-install-") as scratch:
            walk = Walk(Path(scratch), offline)
            try:
                if not (dist / "wheels").is_dir():
                    raise NotHere("no dist/wheels: make packages")  # noqa: TRY301
                go(walk, dist)
            except NotHere as why:
                print(f"{name}: not possible here: {why}", flush=True)
                continue
            except WayFailed as why:
                print(f"{name}: failed: {why}", flush=True)
                aims.append(Aim(f"{name}: no page", met=False))
                continue
        print(f"{name}: {len(walk.steps)} steps, {walk.seconds:.1f} s from file to page")
        for number, step in enumerate(walk.steps, start=1):
            worked = f"{step.processor_s:.1f} s of a processor"
            print(f"  {number}. {step.typed}: {step.seconds:.1f} s ({worked})", flush=True)
        if aim_s is not None:
            words = f"{name}: {walk.seconds:.1f} s, aim {aim_s:g} s"
            aims.append(Aim(words, walk.seconds <= aim_s))
        if go is folder:
            cold = walk.steps[-1].seconds
            aims.append(Aim(f"unpacked folder to page: {cold:.1f} s, aim 10 s", cold <= 10.0))
            aims.append(Aim(f"its cold start: {cold:.1f} s, aim 5 s", cold <= 5.0))
    return not print_verdict(aims)


if __name__ == "__main__":
    raise SystemExit(main())
