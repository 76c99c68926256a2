"""Process data: contents of PDOs, set-up of drives for them, and the SYNC loop."""
