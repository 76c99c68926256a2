"""Safety acceptance record: what an axis does when a person triggers a safety function."""
