"""Log-in under attack: budgets of wrong tries, turns at the password hash, known browsers."""
