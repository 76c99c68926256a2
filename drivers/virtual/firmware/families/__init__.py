"""What differs between drive families: conventions, protections, special commands."""
