"""Tables of axis condition: rounds of health checks, and signed baselines."""

import sqlalchemy as sa
from alembic import op

from backend.foundation.store.base import UtcDateTime

revision = "health_0001"
down_revision = None
branch_labels = ("health",)
depends_on = None


def upgrade() -> None:
    """Create the tables."""
    op.create_table(
        "health_run",
        sa.Column("id", sa.Integer, primary_key=True),
        sa.Column("station", sa.String(100), nullable=False),
        sa.Column("axis_key", sa.String(200), nullable=False),
        sa.Column("axis", sa.String(200), nullable=False),
        sa.Column("profile", sa.String(100), nullable=False),
        sa.Column("vendor_id", sa.BigInteger),
        sa.Column("product_code", sa.BigInteger),
        sa.Column("revision", sa.BigInteger),
        sa.Column("serial", sa.BigInteger),
        sa.Column("firmware", sa.String(100), nullable=False),
        sa.Column("taken", UtcDateTime, nullable=False),
        sa.Column("person", sa.String(200), nullable=False),
        sa.Column("settings", sa.JSON, nullable=False),
        sa.Column("settings_sha256", sa.String(64), nullable=False),
        sa.Column("measurements", sa.JSON, nullable=False),
        sa.Column("round", sa.Text, nullable=False),
    )
    op.create_index("ix_health_run_axis_key_taken", "health_run", ["axis_key", "taken"])
    op.create_table(
        "health_baseline",
        sa.Column("id", sa.Integer, primary_key=True),
        sa.Column("axis_key", sa.String(200), nullable=False, index=True),
        sa.Column("signed", UtcDateTime, nullable=False),
        sa.Column("person", sa.String(200), nullable=False),
        sa.Column("notes", sa.Text, nullable=False),
        sa.Column("content", sa.JSON, nullable=False),
        sa.Column("sha256", sa.String(64), nullable=False),
    )


def downgrade() -> None:
    """Refused, as baselines would be lost: restore a backup of the older version instead."""
    raise NotImplementedError("restore a backup of the older version")
