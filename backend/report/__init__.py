"""The commissioning report of an axis: gathered, composed in a language, and rendered."""
