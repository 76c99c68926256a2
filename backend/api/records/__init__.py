"""Routes of what is kept and passed on: sets, library, handover, audit."""
