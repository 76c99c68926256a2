"""The checks of texts: banned words of the term base, length of sentences, pictures, figures.

``python .ci/docs --check`` fails where a text breaks a rule; ``python .ci/docs --coverage`` prints
how much of the profiles' texts is there in Chinese.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import pictures
import prose
import terms


def check() -> int:
    """Print what breaks a rule; the exit code."""
    known = terms.load()
    found = [
        *prose.words_in_pages(known),
        *prose.words_in_messages(known),
        *prose.words_on_page(known),
        *prose.words_elsewhere(known),
        *prose.words_in_code(),
        *prose.long_sentences(),
        *prose.long_texts(),
        *prose.english_titles(),
        *prose.missing_pictures(),
        *pictures.findings(),
    ]
    for finding in found:
        print(finding)
    print(f"{len(known)} terms, {len(found)} findings")
    return 1 if found else 0


def coverage() -> int:
    """Print how many texts of each profile are there in Chinese."""
    import chinese

    for line in chinese.lines():
        print(line)
    return 0


def main() -> int:
    """Entry point."""
    parser = argparse.ArgumentParser(description=__doc__)
    chosen = parser.add_mutually_exclusive_group(required=True)
    chosen.add_argument("--check", action="store_true", help="fail where a text breaks a rule")
    chosen.add_argument("--coverage", action="store_true", help="Chinese texts of the profiles")
    return check() if parser.parse_args().check else coverage()


if __name__ == "__main__":
    sys.exit(main())
