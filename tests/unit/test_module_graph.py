"""The drawing of the rooms in the documentation shows the imports as they are."""

from __future__ import annotations

import pytest

from benchmarks import module_graph


@pytest.fixture(scope="module")
def graph() -> module_graph.Graph:
    return module_graph.read_graph()


def test_the_drawing_and_the_list_are_those_of_the_imports(graph):
    how = "run `python -m benchmarks.module_graph` and look at what it changed"
    assert module_graph.LIST.read_text("utf-8") == module_graph.as_list(graph), how
    assert module_graph.PICTURE.read_text("utf-8") == module_graph.as_svg(graph), how


def test_every_arrow_downward_leads_to_a_lower_floor(graph):
    assert graph.down
    for importing, imported in graph.down:
        assert graph.floors[importing] > graph.floors[imported], (importing, imported)


def test_an_arrow_that_others_imply_is_not_drawn():
    assert module_graph.needed([("a", "b"), ("b", "c"), ("a", "c")]) == [("a", "b"), ("b", "c")]
