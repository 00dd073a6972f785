"""The tables (typed ORM); only migrations/ creates them.

Rows are written once: a repeated upload is a new take, a result is a new row. Only a job's row changes, and
``events`` has each change. The database itself refuses to change or delete what a calibration is made of
(migration 0003). Nothing here depends on the kind of database. A table has a column where a query needs one; the
rest of a result is a contract model as JSON.
"""

from store.tables import (  # noqa: F401 - each table is known when any is: they refer to each other by name
    access,
    base,
    calibrations,
    events,
    images,
    jobs,
    measurements,
    processes,
    spines,
    stages,
    surgeries,
)
