"""Results of tools as files, pages and programs read them: one schema, chosen by ``tool``.

The measurements are of a first-order loop whose figures are known (`tests.support.measurements`).
"""

from __future__ import annotations

import json
from collections.abc import Callable
from datetime import UTC, datetime
from typing import Any

import pytest
from pydantic import TypeAdapter, ValidationError

from backend.axes.drive.drive import Drive
from backend.records.library.measurements import unpack
from backend.station.evaluation import recompute
from backend.tools.registry import BY_KIND
from backend.tools.results import ToolOutcome
from tests.support import measurements as known

OUTCOME: TypeAdapter[Any] = TypeAdapter(ToolOutcome)
MADE: dict[str, Callable[[], Any]] = {
    "step": known.step,
    "inertia": known.inertia,
    "sweep": known.speed_loop,
}


def stored(drive: Drive, kind: str) -> dict[str, object]:
    return recompute(unpack(known.file_of(drive, MADE[kind](), datetime.now(UTC))))


@pytest.mark.parametrize("kind", MADE)
def test_a_result_keeps_to_the_published_schema(drive: Drive, kind: str) -> None:
    result = stored(drive, kind)
    # Strict JSON: no NaN and no Infinity, which other programs cannot read.
    text = json.dumps(result, allow_nan=False)
    assert type(OUTCOME.validate_json(text)) is BY_KIND[kind].result
    assert json.loads(OUTCOME.dump_json(OUTCOME.validate_json(text))) == json.loads(text)


@pytest.mark.parametrize("kind", MADE)
def test_a_field_that_is_not_published_is_refused(drive: Drive, kind: str) -> None:
    with pytest.raises(ValidationError, match="unheard_of"):
        OUTCOME.validate_python(stored(drive, kind) | {"unheard_of": 1.0})


@pytest.mark.parametrize("kind", MADE)
def test_command_line_and_report_say_it_in_both_languages(drive: Drive, kind: str) -> None:
    tool = BY_KIND[kind]
    result = tool.result.model_validate(stored(drive, kind))
    for language in ("en", "zh"):
        section = tool.report(result.in_language(language))
        said = [tool.text(each.name, language, each.values) for each in section.notes]
        said += [tool.text(each.name, language, each.values) for each in section.rows]
        said += [
            cell for grid in section.grids for row in tool.cells(grid, language) for cell in row
        ]
        for chart in section.charts:
            names = (chart.name, chart.x_name, chart.y_name, *(line.name for line in chart.lines))
            said += [tool.text(name, language) for name in names]
        assert all(said)
        assert any("\u4e00" <= sign <= "\u9fff" for sign in "".join(said)) == (language == "zh")
