"""The wheel in a fresh virtual environment, as pipx and uv make one: the page is inside."""

from __future__ import annotations

import shutil
import subprocess
import sys
import sysconfig
import zipfile
from importlib.metadata import distribution
from pathlib import Path

import pytest

from tests.support.installed import plain_environment, served

ROOT = Path(__file__).resolve().parents[3]
PAGE = ROOT / "webui/dist"
PARTS = ("backend", "drivers", "profiles")
FILES = ("pyproject.toml", "hatch_build.py", "README.md", "LICENSE", "NOTICE")

pytestmark = pytest.mark.skipif(
    not (PAGE / "index.html").is_file(), reason="the page is not built (make page)"
)


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Built as from an unpacked source distribution, which brings the built page along."""
    folder = Path(tmp_path_factory.mktemp("sdist"))
    for name in PARTS:
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
    for name in FILES:
        shutil.copyfile(ROOT / name, folder / name)
    shutil.copytree(PAGE, folder / "webui/dist")
    metadata = distribution("servodeck").read_text("METADATA")
    assert metadata is not None
    (folder / "PKG-INFO").write_text(metadata, "utf-8")
    subprocess.run(
        [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder / "built")],
        cwd=folder,
        check=True,
        capture_output=True,
        env={"PATH": "/nowhere"},
    )
    (built,) = (folder / "built").glob("servodeck-*.whl")
    return built


@pytest.mark.long
def test_the_wheel_contains_the_page_and_nothing_of_the_tests(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as packed:
        names = set(packed.namelist())
    built = {str(path.relative_to(PAGE)) for path in PAGE.rglob("*") if path.is_file()}
    assert {f"backend/web/{name}" for name in built} <= names
    assert not {name for name in names if name.startswith(("tests/", "benchmarks/", "webui/"))}


def test_a_fresh_environment_serves_the_page_without_node_and_checkout(
    wheel: Path, tmp_path: Path
) -> None:
    environment = tmp_path / "environment"
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", str(environment)], check=True)
    # The packages that it needs are those of the tests; the whole way is benchmarks/install.py.
    python = environment / "bin/python"
    (site,) = environment.glob("lib/python*/site-packages")
    (site / "packages.pth").write_text(sysconfig.get_path("purelib") + "\n")
    subprocess.run(
        [sys.executable, "-m", "pip", "--python", str(python), "install", "--quiet", "--no-deps",
         "--no-index", "--no-compile", "--ignore-installed", str(wheel)],
        check=True,
    )  # fmt: skip
    plain = plain_environment(tmp_path / "home", environment / "bin")
    where = subprocess.run(
        [python, "-c", "import backend; print(backend.__file__)"],
        cwd=tmp_path,
        env=plain,
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    assert Path(where.strip()).is_relative_to(environment)
    command = [environment / "bin/servodeck", "serve", "--port", "0", "--config", "state"]
    with served(command, tmp_path, plain) as answer:
        assert answer.page == (PAGE / "index.html").read_text("utf-8")
        assert answer.assets
