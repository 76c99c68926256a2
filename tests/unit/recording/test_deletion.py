"""A recording that is in use is not deleted, by whichever route."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import pytest

from backend.api.records.library.routes import delete_library_entry
from backend.records.library.entries import Query
from backend.records.recording.writer import RecordingWriter
from backend.station.bench import Bench
from backend.station.recording.service import Recordings
from drivers.errors import Busy
from tests.unit.recording.support import header


async def test_the_library_deletes_no_recording_that_is_in_use(tmp_path: Path) -> None:
    bench = Bench(tmp_path)
    await bench.records.open()
    recordings = Recordings(bench, tmp_path / "recordings")
    name = "one.sdrec"
    path = recordings.library.folder / name
    path.parent.mkdir(exist_ok=True)
    RecordingWriter(path, header(), lambda _error: None).close({})
    try:
        bench.records.index.refresh()
        entries, _ = bench.records.library.search(Query(kinds=("recording",)))
        (entry,) = entries
        recordings.running[name] = SimpleNamespace()  # type: ignore[assignment]
        with pytest.raises(Busy, match="being recorded"):
            await delete_library_entry(bench, recordings, entry.id)
        recordings.running.clear()
        job = SimpleNamespace(state="running")
        recordings._exporting[name, "csv"] = job  # type: ignore[assignment]
        with pytest.raises(Busy, match="export"):
            await delete_library_entry(bench, recordings, entry.id)
        assert path.is_file()
        job.state = "done"
        answer = await delete_library_entry(bench, recordings, entry.id)
        assert answer.status_code == 204
        assert not path.exists()
        assert bench.records.library.search(Query(kinds=("recording",)))[1] == 0
    finally:
        await bench.close()
