"""What is kept and passed on: audit, recordings, library, imported responses, hand-over."""
