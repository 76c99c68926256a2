"""Commands that start and keep a server: service, people, backup, preflight."""
