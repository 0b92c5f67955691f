import re
import warnings
from dataclasses import replace
from html.parser import HTMLParser

import pytest
from fake_evaluations import fake_evaluation, fake_evaluations
from markupsafe import Markup

from mjx_inertia.evaluation import (
    Published,
    ReportContent,
    Section,
    SplitText,
    summarize_all,
    write_report,
)
from mjx_inertia.evaluation.report import headline_groups, render_report
from mjx_inertia.evaluation.summary import format_number

pytestmark = pytest.mark.long
SPLITS = (
    SplitText("thesis", "on new pushes of known cubes", "Training and test share cubes."),
    SplitText("grouped", "on cubes never seen in training", "Whole cubes are held out."),
)
EVIL = "<script>alert('x')</script>"


@pytest.fixture
def blank_images(monkeypatch):
    """Leaves out the slow part where only the words matter."""
    monkeypatch.setattr("mjx_inertia.evaluation.report.to_data_uri", lambda figure: "data:,")


class Tags(HTMLParser):
    """Collects the tags and attributes of a page and checks that they nest."""

    VOID = frozenset({"meta", "img", "br"})

    def __init__(self):
        HTMLParser.__init__(self)
        self.seen, self.addresses, self.open = [], [], []

    def handle_starttag(self, tag, attrs):
        self.seen.append(tag)
        self.addresses += [v for k, v in attrs if k in ("src", "href", "srcset", "data")]
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


@pytest.fixture(scope="module")
def content():
    return ReportContent(
        title="Quick run",
        evaluations=fake_evaluations(pushes=240),
        splits=SPLITS,
        config_yaml=f"seed: 0\nname: {EVIL}\n",
        versions={"jax": "0.8.0", EVIL: EVIL},
        published=(
            Published("thesis, Table 3.3", {"mass": (7.59, 11.04)}, split="thesis"),
            Published("another dataset", {"mass": (1.0, 2.0)}, dataset="full"),
        ),
        sections=(
            Section("Plain", f"text with {EVIL}", "caption " + EVIL),
            Section("Marked", Markup("<p id='mine'>mine</p>"), ""),
        ),
    )


@pytest.fixture(scope="module")
def page(content):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return render_report(content)


def words(page):
    text = re.sub(r'src="data:[^"]*"', "", page)
    text = re.sub(r"<style>.*?</style>", "", text, flags=re.DOTALL)
    return re.sub(r"\s+", " ", re.sub(r"<[^>]*>", "", text).replace("\u00a0", " "))


def test_page_needs_nothing_from_outside(page):
    tags = Tags()
    tags.feed(page)
    assert tags.open == []
    assert not {"script", "link", "iframe", "object"} & set(tags.seen)
    assert tags.addresses
    assert all(address.startswith("data:image/") for address in tags.addresses)
    assert "http" not in page
    assert "@import" not in page
    assert "url(" not in page
    assert len(page) < 3e6


def test_names_are_escaped(page, content, blank_images):
    assert "<script" not in page
    assert "&lt;script&gt;" in page
    assert "<p id='mine'>mine</p>" in page
    first = replace(content.evaluations[0], estimator=EVIL, dataset=EVIL, split=EVIL)
    assert "<script" not in render_report(replace(content, evaluations=[first], splits=()))


def test_verdict_is_about_unseen_cubes_and_names_the_baseline(page, content):
    rows = {
        (s.estimator, s.target): format_number(s.headline.mean)
        for s in summarize_all(content.evaluations)
        if s.split == "grouped"
    }
    assert (
        f"boosted: mass {rows['boosted', 'mass']} %, Izz {rows['boosted', 'inertia']} %, "
        f"CoM {rows['boosted', 'com_x']} / {rows['boosted', 'com_y']} mm "
        f"on cubes never seen in training; predicting the training mean: "
        f"mass {rows['mean', 'mass']} %"
    ) in words(page)
    assert "boosted is overconfident" in page
    assert page.index(">grouped <small") < page.index(">thesis <small")


def test_all_numbers_are_in_the_page(page, content):
    text = words(page)
    for row in summarize_all(content.evaluations):
        for value in (
            row.abs_mean_percent,
            row.abs_median_percent,
            row.signed_std_percent,
            row.headline.mean,
            row.headline.low,
            row.headline.high,
        ):
            assert format_number(value) in text
        assert f"{row.calibration.z_rms:.2f}" in text
    assert "7.6 ± 11.0 %" in text
    assert text.count("thesis, Table 3.3") == 1
    assert "another dataset" not in text
    for split in SPLITS:
        assert split.definition in text


def test_failures_and_left_out_rows_are_counted(page, content):
    assert "LOST_CONTACT 1" in page
    assert "BAD_INPUT 2" in page
    assert "mean, forest, boosted" in page
    row = next(s for s in summarize_all(content.evaluations) if s.target == "com_y")
    assert f"CoM y, {row.split}: {row.left_out} of {row.pushes}" in words(page)


def test_best_and_baseline_are_marked(content):
    groups = headline_groups(summarize_all(content.evaluations), "mean", {})
    for group in groups:
        assert next((row.name, row.kind) for row in group.rows) == ("mean", "baseline")
        assert [cell.best for row in group.rows for cell in row.cells[:4]] == [False] * 8 + [
            True
        ] * 4
        assert all(cell.bar == 1.0 for cell in group.rows[0].cells[:4])
        assert all(0 < cell.bar < 1 for cell in group.rows[-1].cells[:4])


def test_an_estimator_no_better_than_the_baseline_is_called_so(blank_images):
    baseline = fake_evaluation("mean", None)
    same = replace(baseline, estimator="forest")
    text = words(render_report(ReportContent("t", [baseline, same])))
    assert "not clearly better than the baseline on mass, Izz, CoM x, CoM y" in text


def test_page_of_failures_and_without_baseline(tmp_path, blank_images):
    broken = fake_evaluation("broken", 0.1, pushes=20, failed=20)
    path = tmp_path / "report.html"
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        write_report(path, ReportContent("t", [broken]))
    text = words(path.read_text())
    assert "There is no baseline" in text
    assert "mass – %" in text
    with pytest.raises(ValueError, match="empty"):
        render_report(ReportContent("t", []))
