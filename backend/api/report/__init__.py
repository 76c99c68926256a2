"""Routes of the commissioning report."""
