"""The history of the tables (Alembic); the only way a table is made, in tests too."""
