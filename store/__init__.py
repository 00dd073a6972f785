"""The database: tables, sessions, queries, jobs, events, and the queue that wakes workers."""
