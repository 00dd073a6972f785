"""Worker processes: take a job, decode its pictures, call the library, write the result."""
