"""The drives of the list: their names, files, ports and monitors, and how they are found again."""
