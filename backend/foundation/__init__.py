"""What every other room uses: database and files, people and their rights, jobs, this computer."""
