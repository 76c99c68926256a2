"""Start-up lists for a machine's controller: export, comparison, what changed since."""
