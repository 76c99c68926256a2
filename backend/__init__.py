"""What the engineer does: drives, axes, jobs, tools, the server and the command line."""
