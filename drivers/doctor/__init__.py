"""Why a drive does not reach Operational: facts read from it, and the causes that match them."""
