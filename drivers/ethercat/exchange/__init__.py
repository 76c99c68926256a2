"""Process data: mapping, preparation, the cyclic exchange, samples, recovery."""
