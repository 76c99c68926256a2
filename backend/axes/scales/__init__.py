"""Scales of raw positions, speeds and accelerations of one drive, with their origins.

`scale` holds the types, `resolve` determines them from profile and drive, `taught` holds what a
person stated of an axis, `compare` checks whether 606Ch and 6064h of a recording agree.
"""
