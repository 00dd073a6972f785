"""Worker processes: take a job, decode its pictures, call the measuring library, write the result."""
