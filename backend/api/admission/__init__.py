"""Limits on connections and requests, so that a crowd cannot shut out STOP or a person."""
