"""Alembic without its command line: the migration scripts are packaged with the program.

Every part of the program has a branch of its own (``library``, ``audit`` …), so that each can add
revisions independently of the others; an upgrade runs to the heads of all branches.
"""

from __future__ import annotations

from pathlib import Path

from alembic import command
from alembic.config import Config
from alembic.script import ScriptDirectory
from sqlalchemy import Connection

_FOLDER = Path(__file__).parent / "migrations"


def _config() -> Config:
    config = Config()
    config.set_main_option("script_location", str(_FOLDER).replace("%", "%%"))
    config.set_main_option("path_separator", "os")
    return config


def known_revisions() -> frozenset[str]:
    """Names of all revisions of this program, taken from the file names; no script is executed."""
    return frozenset(file.stem for file in (_FOLDER / "versions").glob("*_[0-9]*.py"))


def script() -> ScriptDirectory:
    """Script directory with all revisions of this program."""
    return ScriptDirectory.from_config(_config())


def upgrade(connection: Connection) -> None:
    """Migrate the tables to the heads, within the connection's transaction."""
    config = _config()
    config.attributes["connection"] = connection
    command.upgrade(config, "heads")
