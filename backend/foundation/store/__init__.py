"""Database and files of a station: tables, migrations, blobs, free space."""
