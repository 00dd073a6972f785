"""Contents of images stand last in their rows: SQLite reads all that stands before a column to get at it.

A list of images, such as a summary has, read each file for its width. PostgreSQL keeps files apart from the rows.
"""

from __future__ import annotations

from typing import Any

import sqlalchemy as sa
from alembic import op

revision = "0019"
down_revision = "0018"
branch_labels = None
depends_on = None

_FACTS = ("media_type", "width", "height", "size_bytes", "created_at")
_TRIGGERS = "SELECT sql FROM sqlite_master WHERE type = 'trigger' AND tbl_name = 'images'"


def upgrade() -> None:
    """Make the change."""
    _arrange("sha256", *_FACTS, "content")


def downgrade() -> None:
    """Take the change back."""
    _arrange("sha256", "content", *_FACTS)


def _arrange(*names: str) -> None:
    """Make the table anew with its columns in this order."""
    connection = op.get_bind()
    if connection.dialect.name != "sqlite":
        return
    columns: dict[str, sa.types.TypeEngine[Any]] = {
        "sha256": sa.String(length=64),
        "content": sa.LargeBinary(),
        "media_type": sa.String(length=64),
        "width": sa.Integer(),
        "height": sa.Integer(),
        "size_bytes": sa.BigInteger(),
        "created_at": sa.DateTime(timezone=True),
    }
    triggers = connection.scalars(sa.text(_TRIGGERS)).all()  # they go with the table
    # rows of other tables refer to images: that is checked at the end, when all images are back
    op.execute("PRAGMA defer_foreign_keys = ON")
    op.execute("CREATE TABLE images_aside AS SELECT * FROM images")
    op.drop_table("images")
    op.create_table(
        "images",
        *(sa.Column(name, columns[name], nullable=False) for name in names),
        sa.PrimaryKeyConstraint("sha256", name=op.f("pk_images")),
    )
    listed = ", ".join(names)
    op.execute(f"INSERT INTO images ({listed}) SELECT {listed} FROM images_aside")  # noqa: S608 - named above
    op.drop_table("images_aside")
    for trigger in triggers:
        connection.exec_driver_sql(trigger)
