"""Log-in under attack: budgets of wrong tries, turns at the hash, browsers that are known."""
