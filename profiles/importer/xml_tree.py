"""Small steps through an XML tree that take a missing element for an empty one."""

from __future__ import annotations

from xml.etree.ElementTree import Element


def strip_namespaces(root: Element) -> None:
    """Take ``{namespace}`` off every tag: makers use several, or none."""
    for element in root.iter():
        if isinstance(element.tag, str):
            element.tag = element.tag.rpartition("}")[2]


def child(element: Element | None, tag: str) -> Element | None:
    """The first child with this tag, whatever the case of its letters."""
    return next(iter(children(element, tag)), None)


def children(element: Element | None, tag: str) -> list[Element]:
    """All children with this tag, whatever the case of its letters."""
    if element is None:
        return []
    wanted = tag.lower()
    return [e for e in element if isinstance(e.tag, str) and e.tag.lower() == wanted]


def text_of(element: Element | None) -> str:
    """Its text without surrounding space."""
    return "" if element is None or element.text is None else element.text.strip()
