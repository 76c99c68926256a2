"""Routes of accounts, sessions, tokens, and of people who are connected."""
