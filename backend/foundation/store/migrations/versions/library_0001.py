"""Tables of the library: items, versions, tags and small contents."""

import sqlalchemy as sa
from alembic import op

from backend.foundation.store.base import UtcDateTime

revision = "library_0001"
down_revision = None
branch_labels = ("library",)
depends_on = None


def upgrade() -> None:
    """Create the tables."""
    op.create_table(
        "library_item",
        sa.Column("id", sa.Integer, primary_key=True),
        sa.Column("kind", sa.String(20), nullable=False),
        sa.Column("station", sa.String(100), nullable=False),
        sa.Column("name", sa.String(200), nullable=False),
        sa.Column("notes", sa.Text, nullable=False),
        sa.Column("words", sa.Text, nullable=False),
        sa.Column("changed", UtcDateTime, nullable=False, index=True),
        sa.Column("deleted", UtcDateTime),
        sa.UniqueConstraint("kind", "station", "name", name="uq_library_item_name"),
    )
    op.create_table(
        "library_version",
        sa.Column("id", sa.Integer, primary_key=True),
        sa.Column(
            "item_id",
            sa.Integer,
            sa.ForeignKey("library_item.id", ondelete="CASCADE"),
            nullable=False,
        ),
        sa.Column("number", sa.Integer, nullable=False),
        sa.Column("saved", UtcDateTime, nullable=False, index=True),
        sa.Column("author", sa.String(200), nullable=False),
        sa.Column("notes", sa.Text, nullable=False),
        sa.Column("place", sa.String(10), nullable=False),
        sa.Column("sha256", sa.String(64), nullable=False, index=True),
        sa.Column("bytes", sa.BigInteger, nullable=False),
        sa.Column("profile", sa.String(100), nullable=False, index=True),
        sa.Column("axis", sa.String(200), nullable=False),
        sa.Column("vendor_id", sa.BigInteger),
        sa.Column("product_code", sa.BigInteger),
        sa.Column("revision", sa.BigInteger),
        sa.Column("serial", sa.BigInteger, index=True),
        sa.Column("firmware", sa.String(100), nullable=False),
        sa.Column("facts", sa.JSON, nullable=False),
        sa.UniqueConstraint("item_id", "number", name="uq_library_version_number"),
    )
    op.create_table(
        "library_tag",
        sa.Column(
            "item_id",
            sa.Integer,
            sa.ForeignKey("library_item.id", ondelete="CASCADE"),
            primary_key=True,
        ),
        sa.Column("tag", sa.String(60), primary_key=True, index=True),
    )
    op.create_table(
        "library_content",
        sa.Column("sha256", sa.String(64), primary_key=True),
        sa.Column("data", sa.LargeBinary, nullable=False),
    )


def downgrade() -> None:
    """Refused, as versions would be lost: restore a backup of the older version instead."""
    raise NotImplementedError("restore a backup of the older version")
