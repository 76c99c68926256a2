"""Search, export and check of the audit, and recording of changes made through the interface."""
