"""Check of the computer's timing: obstacles, measurement, and the most effective remedy.

`findings` (from the facts of the computer) and `verdicts` (from the measurement) have no I/O;
`fixes` changes and restores settings; `run` measures; `texts` has the texts in both languages.
"""
