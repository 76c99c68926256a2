"""The report says what was measured and changed, in both languages, and nothing else runs in it."""

from __future__ import annotations

import base64
import hashlib
import io
import re
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from html.parser import HTMLParser
from pathlib import Path

import pytest
from pypdf import PdfReader
from typer.testing import CliRunner

from backend import report
from backend.axes.drive.drive import Drive
from backend.cli import app
from backend.records.library.measurements import MeasurementStore
from backend.report.changes import Change, ChangeLog, net
from backend.report.compose import compose
from backend.report.document import Document, Language, Note, Table
from backend.report.facts import ChangedSetting, Facts, Identity, Measured
from backend.report.gather import choose, measured_from, shown
from backend.report.render.html import render_html
from backend.report.render.pdf import render_pdf
from backend.report.render.plot import Area, Curve, Label, Line, Plot, draw
from backend.report.render.plot import Path as Stroke
from backend.report.store import ReportStore
from backend.report.texts import TEXTS
from backend.tools.tuning.sweep.result import SweepAnswer
from drivers.errors import NotAllowed
from drivers.texts.message import prose
from tests.support import measurements as known

T0 = datetime(2026, 3, 1, 12, 0, tzinfo=UTC)
NASTY = "<script>alert(1)</script> & \"x\" onload='y' 主轴 ω⁻⁴ \x07\u202e𝄞"


def at(minutes: float) -> datetime:
    return T0 + timedelta(minutes=minutes)


@pytest.fixture
def store(drive: Drive, tmp_path: Path) -> MeasurementStore:
    """Before tuning a step; then everything."""
    store = MeasurementStore(tmp_path / "measurements")
    store.store("1-step.sdmeas", known.file_of(drive, known.step(80.0), at(1)))
    store.store("2-inertia.sdmeas", known.file_of(drive, known.inertia(), at(2)))
    store.store("3-loop.sdmeas", known.file_of(drive, known.speed_loop(), at(9)))
    store.store("4-step.sdmeas", known.file_of(drive, known.step(), at(10)))
    return store


@pytest.fixture
def facts(store: MeasurementStore) -> Facts:
    heads = {name: store.head(name) for name in store.names()}
    measured, unusable = measured_from(store, choose(heads, at(5)))
    assert not unusable
    change = ChangedSetting("2005:03", "Speed bandwidth", "40 Hz", "142.6 Hz", at(5))
    return Facts(
        Identity("Feed screw", "Sample drive", "000", "abc123", 0x59A, 0x10, 0x2, 4711, "1.07",
                 ("mlink:///dev/ttyUSB0 #1",)),
        at(20), "0.1.0", "王工", "Press 4", "Coupling was loose.\nTightened.",
        (change,), at(5), measured,
    )  # fmt: skip


def texts_of(document: Document) -> list[str]:
    found: list[str] = []
    for block in document.blocks:
        if isinstance(block, Note):
            found.append(block.text)
        if isinstance(block, Table):
            found += [" | ".join(row) for row in block.rows]
    return found


def pdf_text(data: bytes) -> str:
    return "\n".join(page.extract_text() for page in PdfReader(io.BytesIO(data)).pages)


class Page(HTMLParser):
    """Tags, attributes and text of an HTML page."""

    def __init__(self, data: bytes) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.text = ""
        self.style = ""
        self.feed(data.decode())

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))

    def handle_data(self, data: str) -> None:
        if self.tags and self.tags[-1][0] == "style" and not self.style:
            self.style = data
        else:
            self.text += data


# --- what was changed ------------------------------------------------------------------


def test_changes_are_kept_and_folded(tmp_path: Path) -> None:
    log = ChangeLog(tmp_path)
    log.add("x", Change(at(1), "gains", {"a": 1, "b": 5, "same": 7}, {"a": 2, "b": 6, "same": 7}))
    log.add("x", Change(at(2), "gains", {"a": 2}, {"a": 3}))
    log.add("x", Change(at(3), "undo", {"b": 6}, {"b": 5}))
    log.add("y", Change(at(3), "gains", {"a": 8}, {"a": 9}))
    found = net(ChangeLog(tmp_path).read("x"))
    # b was undone, so nothing of it remains; "same" never changed.
    assert [(row.key, row.before, row.after, row.time) for row in found] == [("a", 1, 3, at(2))]


def test_a_line_that_a_crash_cut_short_costs_only_itself(tmp_path: Path) -> None:
    log = ChangeLog(tmp_path)
    log.add("x", Change(at(1), "gains", {"a": 1}, {"a": 2}))
    with next(tmp_path.iterdir()).open("a") as file:
        file.write('{"time": "2026-03-01T12:0')
        file.write("\n[1]\n")
    log.add("x", Change(at(2), "gains", {"a": 2}, {"a": 4}))
    assert [row.after for row in net(log.read("x"))] == [4]


def test_a_drive_cannot_write_outside_the_folder(tmp_path: Path) -> None:
    log = ChangeLog(tmp_path / "changes")
    log.add("../../x", Change(at(1), "gains", {"a": 1}, {"a": 2}))
    assert [p.parent for p in tmp_path.rglob("*.jsonl")] == [tmp_path / "changes"]


def test_values_are_shown_as_the_manual_means_them(drive: Drive) -> None:
    assert shown(drive.parameter("2005:03"), 1426) == "142.6 Hz"
    assert shown(drive.parameter("2005:10"), 1) == "1: table"


# --- what is concluded -----------------------------------------------------------------


@pytest.mark.long(keep=2)
@pytest.mark.parametrize(
    ("margins", "tone", "word"),
    [
        ({"phase_margin_deg": 45.0, "gain_margin_db": 8.0, "ms": 2.0}, "good", "sound"),
        ({"phase_margin_deg": 44.9, "gain_margin_db": 9.0, "ms": 1.5}, "warn", "close"),
        ({"phase_margin_deg": 50.0, "gain_margin_db": 7.9, "ms": 1.5}, "warn", "close"),
        ({"phase_margin_deg": 50.0, "gain_margin_db": 9.0, "ms": 2.1}, "warn", "close"),
        ({"phase_margin_deg": 29.0, "gain_margin_db": 9.0, "ms": 2.4}, "fault", "not sound"),
        # A missing margin never counts as kept.
        (
            {"phase_margin_deg": 60.0, "gain_margin_db": None, "ms": 1.2},
            "warn",
            "as far as it was measured",
        ),
        ({"phase_margin_deg": None, "gain_margin_db": None, "ms": None}, "warn", "not known"),
        ({"stable": False, "phase_margin_deg": 60.0, "ms": 1.2}, "fault", "not stable"),
        ({}, "warn", "not known"),
    ],
)
def test_verdict_of_a_loop(
    facts: Facts, margins: dict[str, float | bool | None], tone: str, word: str
) -> None:
    """Limits are those that docs/tuning.md shows."""
    loop = next(m for m in facts.measured if isinstance(m.view, SweepAnswer))
    changed = replace(loop, view=loop.view.model_copy(update={"margins": margins}))
    document = compose(replace(facts, measured=(changed,)), "en")
    note = next(b for b in document.blocks if isinstance(b, Note) and "speed loop" in b.text)
    assert (note.tone, word in note.text) == (tone, True)


def test_the_numbers_of_the_measurements_are_in_the_report(facts: Facts) -> None:
    lines = texts_of(compose(facts, "en"))
    rise = next(line for line in lines if line.startswith("Rise"))
    # Before and after of a linear loop take equally long: ln 9 / (2π · 60 Hz) = 5.8 ms.
    assert re.fullmatch(r"Rise .*\| 5\.[789] ms \| 5\.[789] ms", rise)
    width = next(line for line in lines if line.startswith("Bandwidth (−3 dB)"))
    assert re.fullmatch(r".*\| 6[12]\.?\d* Hz", width)
    inertia = next(line for line in lines if line.startswith("Inertia of motor"))
    assert re.match(r".*\| 0\.000(20|199)", inertia)
    assert "2005:03 | Speed bandwidth | 40 Hz | 142.6 Hz | 2026-03-01 12:05:00" in lines


def measured(facts: Facts, kind: str) -> Measured:
    return next(m for m in facts.measured if m.kind == kind)


def test_a_measurement_from_before_the_change_proves_nothing(facts: Facts) -> None:
    def warned(changed: Facts) -> str:
        return "\n".join(texts_of(compose(changed, "en")))

    assert "Measure again" not in warned(facts)
    step = replace(measured(facts, "step-speed"), saved=at(4))
    loop = measured(facts, "sweep-speed_loop")
    assert "Step of speed: measured before" in warned(replace(facts, measured=(step, loop)))
    old = replace(loop, saved=at(4))
    assert "no loop was measured afterwards" in warned(replace(facts, measured=(old,)))
    assert "no loop was measured" not in warned(replace(facts, measured=(old,), last_change=None))
    # What was written and undone again leaves nothing to be verified, but the loop that was
    # measured meanwhile is of other settings.
    back = replace(facts, changes=(), measured=())
    assert "no loop was measured" not in warned(back)
    assert "no loop was measured afterwards" in warned(replace(back, measured=(old,)))


@pytest.mark.parametrize("widened", ["now", "before"])
def test_steps_with_other_read_outs_are_compared(facts: Facts, widened: str) -> None:
    """Noise asked for a wider settling window in one of two steps: its row stays its own."""
    step = measured(facts, "step-speed")
    assert step.earlier is not None
    plain = step.view.model_copy(update={"widened": False, "window": 2.0})
    wide = plain.model_copy(update={"widened": True, "window": 3.5})
    now, before = (wide, plain) if widened == "now" else (plain, wide)
    both = replace(step, view=now, earlier=replace(step.earlier, view=before))
    document = compose(replace(facts, measured=(both,)), "en")
    (rows,) = [
        {row[0]: row[1:] for row in block.rows}
        for block in document.blocks
        if isinstance(block, Table) and any("Settling window" in row[0] for row in block.rows)
    ]
    (window,) = [cells for name, cells in rows.items() if "Settling window" in name]
    assert window == (("—", "3.5 rpm") if widened == "now" else ("3.5 rpm", "—"))
    torque = f"{now.torque_peak_percent:.0f} %"
    assert rows["Torque peak"] == (torque, torque)


def test_what_is_not_in_order_is_reported(facts: Facts) -> None:
    change = replace(facts.changes[0], now="77 Hz")
    changed = replace(
        facts,
        changes=(change,),
        unsaved=("2005:03 Speed bandwidth",),
        pending=("2005:10 Gain mode",),
        trouble=(prose("0x7500 EtherCAT communication"),),
        unusable=(prose("5.sdmeas is damaged"),),
    )
    text = "\n".join(texts_of(compose(changed, "en")))
    for part in (
        "is 77 Hz now, not 142.6 Hz",
        "not saved in its memory",
        "without effect until",
        "0x7500",
        "5.sdmeas is damaged",
    ):
        assert part in text


def test_the_newest_of_each_kind_is_compared_with_the_one_before(store: MeasurementStore) -> None:
    heads = {name: store.head(name) for name in store.names()}
    assert choose(heads, at(5)) == [
        ("2-inertia.sdmeas", ""),
        ("3-loop.sdmeas", ""),
        ("4-step.sdmeas", "1-step.sdmeas"),
    ]
    assert [earlier for _, earlier in choose(heads, None)] == ["", "", ""]


def test_a_damaged_measurement_does_not_cost_the_report(store: MeasurementStore) -> None:
    path = store.folder / "3-loop.sdmeas"
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 0xFF
    path.write_bytes(data)
    found, unusable = measured_from(store, [("3-loop.sdmeas", ""), ("4-step.sdmeas", "")])
    assert [m.file for m in found] == ["4-step.sdmeas"]
    assert len(unusable) == 1
    assert "3-loop.sdmeas is damaged" in unusable[0].words()


def test_troubles_are_in_the_language_of_the_report(facts: Facts) -> None:
    lost = NotAllowed("library.no-parameter-set", value="a.sdset")
    changed = replace(facts, trouble=(lost.text,), unusable=(lost.text,))
    for language in ("en", "zh"):
        shown = "\n".join(texts_of(compose(changed, language)))
        assert shown.count(lost.text.words(language)) == 2


# --- languages -------------------------------------------------------------------------


def test_both_languages_say_the_same() -> None:
    places = re.compile(r"\{(\w+)\}")
    for name, (english, chinese) in TEXTS.items():
        assert english, name
        assert chinese, name
        assert sorted(places.findall(english)) == sorted(places.findall(chinese)), name
        assert english != chinese, name


def test_every_text_of_the_report_is_used() -> None:
    folder = Path(report.__file__).parent
    source = "".join(file.read_text("utf-8") for file in folder.glob("*.py"))
    put_together = ("kind.", "tone.", "verdict.")
    unused = [
        name
        for name in TEXTS
        if not name.startswith(put_together) and len(re.findall(rf"['\"]{name}['\"]", source)) < 2
    ]
    assert not unused


# --- HTML ------------------------------------------------------------------------------


@pytest.mark.parametrize("language", ["en", "zh"])
def test_html_runs_nothing_and_asks_for_nothing(facts: Facts, language: Language) -> None:
    nasty = replace(
        facts,
        person=NASTY,
        machine=NASTY,
        notes=NASTY,
        trouble=(prose(NASTY),),
        unusable=(prose(NASTY),),
        identity=replace(facts.identity, axis=NASTY, firmware=NASTY),
        changes=(ChangedSetting(NASTY, NASTY, NASTY, NASTY, at(1), NASTY),),
    )
    data = render_html(compose(nasty, language))
    page = Page(data)
    assert {"script", "link", "img", "iframe", "object", "a", "form"}.isdisjoint(
        tag for tag, _ in page.tags
    )
    for tag, attributes in page.tags:
        for name, value in attributes.items():
            assert not name.startswith("on"), tag
            assert name not in ("style", "href", "src"), tag
            assert name == "xmlns" or "http" not in (value or ""), tag
    assert "<script>alert(1)</script>" in page.text
    policy = next(a["content"] for t, a in page.tags if "http-equiv" in a) or ""
    digest = base64.b64encode(hashlib.sha256(page.style.encode()).digest()).decode()
    assert f"style-src 'sha256-{digest}'" in policy
    assert "default-src 'none'" in policy


def test_html_tells_everything(facts: Facts) -> None:
    page = Page(render_html(compose(facts, "en")))
    for part in ("Press 4 · Feed screw", "4711", "0x0000059A", "1.07", "王工", "142.6 Hz",
                 "Tightened.", "4-step.sdmeas", "Compared with 2026-03-01 12:01:00",
                 "±3 rev, 1200 rpm, 80 %", "Signature"):  # fmt: skip
        assert part in page.text
    # Magnitude, phase, coherence of the loop; speed and torque of the step.
    assert sum(tag == "svg" for tag, _ in page.tags) == 5


# --- PDF -------------------------------------------------------------------------------


@pytest.mark.long
def test_pdf_can_be_read_back(facts: Facts) -> None:
    data = render_pdf(compose(facts, "en"))
    reader = PdfReader(io.BytesIO(data))
    text = pdf_text(data)
    assert reader.metadata is not None
    assert reader.metadata.title == "Commissioning report"
    for part in ("Press 4 · Feed screw", "4711", "142.6 Hz", "Tightened.", "Phase margin",
                 "Signature", "Magnitude", "王工"):  # fmt: skip
        assert part in text
    assert all(f"page {n + 1}" in p.extract_text() for n, p in enumerate(reader.pages))
    assert reader.pages[0].mediabox.width == pytest.approx(210 / 25.4 * 72, abs=1)


def test_pdf_is_in_chinese(facts: Facts) -> None:
    text = pdf_text(render_pdf(compose(facts, "zh")))
    for part in ("调试报告", "已更改的设置", "速度环频率响应", "签名", "4711"):
        assert part in text


def test_pdf_brings_its_fonts_along(facts: Facts) -> None:
    """Nothing is left to the reader's computer: names in rare characters, and the field's signs."""
    rare = "龘镕堃 機械 ω Δφ ℃ ① →"
    data = render_pdf(compose(replace(facts, machine=rare), "zh"))
    assert rare in pdf_text(data)
    fonts = {
        str(font["/BaseFont"]): font.get_object()
        for page in PdfReader(io.BytesIO(data)).pages
        for font in (each.get_object() for each in page["/Resources"]["/Font"].values())  # type: ignore[index]
    }
    assert any("Droid" in name for name in fonts)
    for name, font in fonts.items():
        if name != "/Helvetica":  # reportlab names it on every page, and nothing is set in it
            assert "/FontFile2" in font["/FontDescriptor"].get_object(), name


@pytest.mark.long
def test_pdf_takes_any_text(facts: Facts) -> None:
    long = "word " * 4000 + "a" * 3000 + "很长" * 2000
    changed = replace(
        facts,
        notes=f"{long}\n{NASTY}\n</para><b>",
        machine=NASTY,
        unusable=(prose(long),),
        changes=tuple(replace(facts.changes[0], key=f"{i:04X}:00", name=NASTY) for i in range(200)),
    )
    text = pdf_text(render_pdf(compose(changed, "en")))
    assert "<script>alert(1)</script>" in text
    assert "</para><b>" in text
    assert "00C7:00" in text


def test_a_report_of_nothing_is_still_one(facts: Facts) -> None:
    empty = Facts(Identity("X", "Sample drive", "000", ""), T0, "0.1.0")
    for language in ("en", "zh"):
        document = compose(empty, language)  # type: ignore[arg-type]
        assert render_html(document)
        assert render_pdf(document).startswith(b"%PDF")
    assert "Nothing was measured" in "\n".join(texts_of(compose(empty, "en")))


# --- plots -----------------------------------------------------------------------------


def test_a_plot_puts_points_where_its_grid_says() -> None:
    curve = Curve("a", "#123456", [1.0, 10.0, 100.0], [-20.0, 0.0, 20.0], [1.0, 1.0, 1.0])
    drawing = draw(Plot("t", "Hz", "dB", (curve,), (1.0, 100.0), log_x=True))
    line = next(s for s in drawing.shapes if isinstance(s, Stroke) and len(s.points) == 3)
    texts = [s for s in drawing.shapes if isinstance(s, Label)]
    below = {s.text: s.at[0] for s in texts if s.anchor == "middle"}
    grid = [s for s in drawing.shapes if isinstance(s, Line)]
    (x0, y0), (x1, y1), (x2, y2) = line.points
    # Logarithmic: the decades are equally wide, and the middle one lies under its number.
    assert x1 - x0 == pytest.approx(x2 - x1)
    assert below["10"] == pytest.approx(x1)
    assert y0 - y1 == pytest.approx(y1 - y2)
    assert any(s.a[1] == pytest.approx(y0) and s.a[1] == s.b[1] for s in grid)
    assert "−20" in [s.text for s in texts]
    band = next(s for s in drawing.shapes if isinstance(s, Area))
    assert len(band.points) == 6


def test_a_gap_is_not_bridged() -> None:
    curve = Curve("a", "#123456", [0.0, 1.0, 2.0, 3.0, 4.0], [0.0, 1.0, None, 1.0, float("nan")])
    drawing = draw(Plot("t", "s", "", (curve,), (0.0, 4.0)))
    drawn = [s for s in drawing.shapes if isinstance(s, Stroke) and s.color == "#123456"]
    # The two first points, and the short line of the legend.
    assert [len(s.points) for s in drawn] == [2, 2]


# --- files and command line ------------------------------------------------------------


def test_reports_are_plain_files_of_one_folder(tmp_path: Path) -> None:
    store = ReportStore(tmp_path)
    name = store.save("../../Feed <screw>", "pdf", b"%PDF")
    assert (tmp_path / name).read_bytes() == b"%PDF"
    assert store.save("../../Feed <screw>", "pdf", b"2") != name
    assert len(store.names()) == 2
    for bad in ("../x.pdf", "x.exe", ".pdf", "none.pdf"):
        with pytest.raises(NotAllowed):
            store.read(bad)
    store.delete(name)
    assert len(store.names()) == 1


def test_a_report_from_files_alone(store: MeasurementStore, tmp_path: Path) -> None:
    out = tmp_path / "r.html"
    files = [str(store.folder / name) for name in store.names()]
    ran = CliRunner().invoke(app, ["report", *files, "--out", str(out), "--person", "Ann <b>"])
    assert ran.exit_code == 0, ran.output
    text = Page(out.read_bytes()).text
    assert "Ann <b>" in text
    assert "made from files alone" in text
    assert "Compared with 2026-03-01 12:01:00" in text


def test_the_command_refuses_in_words(
    store: MeasurementStore, drive: Drive, tmp_path: Path
) -> None:
    step = str(store.folder / "1-step.sdmeas")

    def fails(*arguments: str) -> str:
        ran = CliRunner().invoke(app, ["report", *arguments])
        assert ran.exit_code == 1, ran.output
        return ran.stderr

    assert "neither HTML nor PDF" in fails(step, "--out", str(tmp_path / "r.doc"))
    assert "either measurement files" in fails("--out", str(tmp_path / "r.pdf"))
    assert "no measurement" in fails(step + "x", "--out", str(tmp_path / "r.pdf"))
    drive.name = "Other"
    store.store("9-other.sdmeas", known.file_of(drive, known.step(), at(11)))
    other = str(store.folder / "9-other.sdmeas")
    assert "different drives" in fails(step, other, "--out", str(tmp_path / "r.pdf"))
    assert not list(tmp_path.glob("r.*"))


def test_recompute_on_the_command_line(store: MeasurementStore, tmp_path: Path) -> None:
    file, out = store.folder / "4-step.sdmeas", tmp_path / "r.json"
    ran = CliRunner().invoke(app, ["recompute", str(file), "--out", str(out)])
    assert ran.exit_code == 0, ran.output
    assert "step of X" in ran.output
    assert '"rise_s": 0.005' in out.read_text()
    file.write_bytes(file.read_bytes()[:-40])
    ran = CliRunner().invoke(app, ["recompute", str(file)])
    assert ran.exit_code == 1
    assert "is damaged" in ran.stderr
    assert "undamaged copy" in ran.stderr
