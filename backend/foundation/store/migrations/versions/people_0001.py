"""Tables of accounts, their sessions, and tokens for scripts."""

import sqlalchemy as sa
from alembic import op

revision = "people_0001"
down_revision = None
branch_labels = ("people",)
depends_on = None

_MOMENT = sa.DateTime(timezone=True)


def _owner() -> sa.Column[int]:
    return sa.Column(
        "account_id",
        sa.Integer,
        sa.ForeignKey("people_account.id", ondelete="CASCADE"),
        nullable=False,
        index=True,
    )


def upgrade() -> None:
    """Create the tables."""
    op.create_table(
        "people_account",
        sa.Column("id", sa.Integer, primary_key=True),
        sa.Column("name", sa.String(60), nullable=False),
        sa.Column("name_key", sa.String(120), nullable=False, unique=True),
        sa.Column("role", sa.String(20), nullable=False),
        sa.Column("password", sa.String(200), nullable=False),
        sa.Column("created", _MOMENT, nullable=False),
    )
    op.create_table(
        "people_session",
        sa.Column("id", sa.String(64), primary_key=True),
        _owner(),
        sa.Column("created", _MOMENT, nullable=False),
        sa.Column("used", _MOMENT, nullable=False),
        sa.Column("client", sa.String(200), nullable=False),
    )
    op.create_table(
        "people_token",
        sa.Column("id", sa.String(64), primary_key=True),
        _owner(),
        sa.Column("name", sa.String(60), nullable=False),
        sa.Column("scopes", sa.String(200), nullable=False),
        sa.Column("created", _MOMENT, nullable=False),
        sa.Column("expires", _MOMENT, nullable=False),
    )


def downgrade() -> None:
    """Refused: accounts must not be discarded."""
    raise NotImplementedError("restore a backup of the older version")
