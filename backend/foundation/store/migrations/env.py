"""Alembic environment, run for every upgrade; the connection comes from `Store`."""

from alembic import context
from sqlalchemy import Connection

from backend.foundation.store.base import Base

connection = context.config.attributes["connection"]
if not isinstance(connection, Connection):
    raise TypeError("the store starts migrations; there is no command line for them")
context.configure(connection=connection, target_metadata=Base.metadata)
with context.begin_transaction():
    context.run_migrations()
