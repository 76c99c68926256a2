"""Search, export and check of the audit; the record of every change."""
