"""Small steps through an XML tree that take a missing element for an empty one."""

from __future__ import annotations

from xml.etree.ElementTree import Element

#: Windows' numbers for English: of the United States, and of none.
_ENGLISH = "1033"


def strip_namespaces(root: Element) -> None:
    """Take ``{namespace}`` off every tag: makers use several, or none."""
    for element in root.iter():
        if isinstance(element.tag, str):
            element.tag = element.tag.rpartition("}")[2]


def child(element: Element | None, tag: str) -> Element | None:
    """The first child with this tag; where there is none, with its letters in another case."""
    if element is None:
        return None
    found = element.find(tag)
    if found is not None:
        return found
    wanted = tag.lower()
    for each in element:
        if isinstance(each.tag, str) and each.tag.lower() == wanted:
            return each
    return None


def children(element: Element | None, tag: str) -> list[Element]:
    """All children with this tag, whatever the case of its letters."""
    if element is None:
        return []
    wanted = tag.lower()
    return [e for e in element if isinstance(e.tag, str) and e.tag.lower() == wanted]


def text_of(element: Element | None) -> str:
    """Its text without surrounding space."""
    return "" if element is None or element.text is None else element.text.strip()


def name_of(element: Element | None) -> str:
    """The English name where there are several, else the first."""
    names = children(element, "Name")
    for name in names:
        if (name.get("LcId") or _ENGLISH).strip() in (_ENGLISH, "9"):
            return text_of(name)
    return text_of(names[0]) if names else ""


def attribute_of(element: Element | None, name: str) -> str:
    """An attribute's value, whatever the case of its name; empty where it is missing."""
    if element is None:
        return ""
    lowered = {key.lower(): value for key, value in element.attrib.items()}
    return lowered.get(name.lower(), "")


def flag_of(element: Element | None, name: str) -> bool:
    """Whether an attribute says yes."""
    return attribute_of(element, name).strip().lower() in ("1", "true")
