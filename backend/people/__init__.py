"""Who may do what: accounts, sessions, tokens, invitations, and the station's certificate."""
