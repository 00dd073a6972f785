"""The record: tables, sessions, queries and the bell; the database is the truth about everything measured."""
