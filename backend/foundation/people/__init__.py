"""Identity and authorization: accounts, sessions, tokens, invitations, and the TLS certificate."""
