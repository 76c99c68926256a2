"""What the cyclic buses share of moving an axis."""
