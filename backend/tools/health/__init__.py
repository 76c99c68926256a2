"""The measurements of an axis by which its condition is followed, one after another in rounds."""
