"""Safety acceptance record: the response of an axis when a person triggers a safety function."""
