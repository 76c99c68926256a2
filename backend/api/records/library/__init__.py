"""The library: search, versions, tags, contents."""
