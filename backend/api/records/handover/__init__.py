"""Start-up lists for a machine's controller: export, comparison, changes since the export."""
