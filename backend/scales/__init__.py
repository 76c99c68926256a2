"""What a raw position, speed or acceleration of one drive means, and how that is known.

`scale` holds the types, `resolve` finds them in the profile and the drive, `taught` is what a
person has said of an axis, `compare` looks whether 606Ch and 6064h of a recording agree.
"""
