"""The motion authority: grants, motion classes of parameters, envelopes, and writes that stop."""
