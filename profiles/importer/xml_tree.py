"""Small steps through an XML tree that take a missing element for an empty one."""

from __future__ import annotations

from xml.etree.ElementTree import Element

#: Windows' numbers for English: of the United States, and of none.
_ENGLISH = "1033"


def simplify_tags(root: Element) -> None:
    """Take ``{namespace}`` off every tag, and capitals off every tag below the root.

    Makers use several namespaces or none, and write the same tag in other letters.
    """
    simple: dict[str, str] = {}
    for element in root.iter():
        tag = element.tag
        if isinstance(tag, str):
            if tag not in simple:
                simple[tag] = tag.rpartition("}")[2].lower()
            element.tag = simple[tag] if element is not root else tag.rpartition("}")[2]


def child(element: Element | None, tag: str) -> Element | None:
    """The first child with this tag, whatever the case of its letters; see `simplify_tags`."""
    return None if element is None else element.find(tag.lower())


def children(element: Element | None, tag: str) -> list[Element]:
    """All children with this tag, whatever the case of its letters."""
    return [] if element is None else element.findall(tag.lower())


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
