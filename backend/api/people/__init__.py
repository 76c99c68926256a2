"""Accounts, sessions, and people who are here."""
