"""The commissioning report of an axis: collecting facts, composing in a language, rendering."""
