"""Worker processes: claim a job, decode its images, call the library, store the result."""
