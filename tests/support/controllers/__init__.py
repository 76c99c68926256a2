"""What controllers make of our lists: readers written from their documentation, not from ours."""
