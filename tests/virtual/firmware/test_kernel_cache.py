"""The compiled loop that is kept on disk is the one of the sources as they are now."""

from __future__ import annotations

import shutil
from pathlib import Path

from numba.core.registry import cpu_target

from drivers.virtual.firmware.kernel import loop

FOLDER = Path(loop.__file__).parent


def key_on_disk(source_digest: str) -> object:
    """What numba looks for on disk before it compiles."""
    dispatcher = loop.compiled(source_digest)
    return dispatcher._cache._index_key((), cpu_target.target_context.codegen())


def test_every_part_of_the_loop_is_in_its_digest(tmp_path: Path) -> None:
    copy = shutil.copytree(FOLDER, tmp_path / "kernel", ignore=shutil.ignore_patterns("__*__"))
    (copy / "__init__.py").write_bytes((FOLDER / "__init__.py").read_bytes())
    whole = loop.sources(copy)
    assert whole == loop.sources(FOLDER)
    for file in sorted(copy.glob("*.py")):
        text = file.read_text()
        file.write_text(text + "\n# changed\n")
        assert loop.sources(copy) != whole, file.name
        file.write_text(text)
    assert loop.sources(copy) == whole


def test_machine_code_of_other_sources_is_not_taken() -> None:
    now = loop.sources(FOLDER)
    assert key_on_disk(now) == key_on_disk(now)
    assert key_on_disk(now) != key_on_disk("other sources")
    assert loop.run.py_func.__closure__[0].cell_contents == now
