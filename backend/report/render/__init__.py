"""A document as HTML page and PDF."""
