"""Access to an XML tree that treats a missing element as an empty one."""

from __future__ import annotations

from xml.etree.ElementTree import Element

#: Windows language number of English (United States); 9 is English without a country.
_ENGLISH = "1033"


def simplify_tags(root: Element) -> None:
    """Remove ``{namespace}`` from every tag, and change tags below the root to lower case.

    Manufacturers use several namespaces or none, and write the same tag in different case.
    """
    simple: dict[str, str] = {}
    for element in root.iter():
        tag = element.tag
        if isinstance(tag, str):
            if tag not in simple:
                simple[tag] = tag.rpartition("}")[2].lower()
            element.tag = simple[tag] if element is not root else tag.rpartition("}")[2]


def child(element: Element | None, tag: str) -> Element | None:
    """Return the first child with this tag, ignoring case; see `simplify_tags`."""
    return None if element is None else element.find(tag.lower())


def children(element: Element | None, tag: str) -> list[Element]:
    """Return all children with this tag, ignoring case."""
    return [] if element is None else element.findall(tag.lower())


def text_of(element: Element | None) -> str:
    """Return its text without surrounding space."""
    return "" if element is None or element.text is None else element.text.strip()


def name_of(element: Element | None) -> str:
    """Return the English name if there are several, else the first."""
    names = children(element, "Name")
    for name in names:
        if (name.get("LcId") or _ENGLISH).strip() in (_ENGLISH, "9"):
            return text_of(name)
    return text_of(names[0]) if names else ""


def attribute_of(element: Element | None, name: str) -> str:
    """Return an attribute's value, ignoring the case of its name; empty if missing."""
    if element is None:
        return ""
    lowered = {key.lower(): value for key, value in element.attrib.items()}
    return lowered.get(name.lower(), "")


def flag_of(element: Element | None, name: str) -> bool:
    """Return whether an attribute is true."""
    return attribute_of(element, name).strip().lower() in ("1", "true")
