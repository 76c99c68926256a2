"""Pages that mkdocs gets from the code and from data, so that they cannot be out of date.

`mkdocs.yml` names this file under ``hooks``. Generated: the reference of the command line from
its definition, one page of parameters per drive from its profile, and the glossary from
``docs/glossary/terms.yaml``. The build fails where a page quotes another figure than the run
that made the pictures, or shows a picture that is not of that run (`pictures.py`).
"""

from __future__ import annotations

import sys
from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files

sys.path.insert(0, str(Path(__file__).parent))

import command_line
import parameters
import pictures
import terms

from profiles.loader import drive_names, load_profile


def on_pre_build(config: MkDocsConfig) -> None:
    """Refuse to build pages that contradict their figures and pictures.

    Raises:
        PluginError: with all findings.
    """
    del config
    if found := [str(each) for each in pictures.findings()]:
        raise PluginError("\n".join(["pictures and figures of different runs:", *found]))


def on_files(files: Files, *, config: MkDocsConfig) -> Files:
    """Add the generated pages."""
    pages = {
        "reference/commands.md": command_line.page(),
        "reference/glossary.md": terms.page(terms.load()),
        "reference/parameters/index.md": parameters.index(),
    }
    for drive in drive_names():
        pages[f"reference/parameters/{drive}.md"] = parameters.page(load_profile(drive))
    for uri, content in pages.items():
        files.append(File.generated(config, uri, content=content))
    return files
