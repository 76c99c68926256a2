"""Is this computer punctual enough: what hinders it, what was measured, what would help most.

`findings` (what the facts of the computer mean) and `verdicts` (what was measured means) are pure;
`fixes` changes settings and undoes it; `run` measures; `texts` has the words of both languages.
"""
