import base64
import dataclasses
import hashlib
import itertools
import json
import re

import cv2
import numpy as np
import pytest

from debulk import Grid, InputError
from debulk.page import stack
from debulk.page.charts import Row, bar_chart
from debulk.page.map import ply_map
from debulk.page.map_labels import label_box, labels, overlap
from debulk.page.net import HEIGHT, WIDTH, net_views
from debulk.page.profile import profile
from debulk.page.render import margin
from debulk.page.report import _drawings, page
from debulk.page.scales import colours, ridge_colours
from debulk.report import Report
from debulk.results.approval import recipe_hash
from debulk.results.bridge_section import BridgeSection
from debulk.results.check_texts import CHECK_TEXTS
from debulk.results.finding import Finding
from debulk.results.report import LeftOut, UnseenHole
from debulk.verdict import Verdict
from html_reader import read


@pytest.fixture(scope="module")
def html(report):
    return page(report)


def test_the_title_block_has_the_hash_by_which_a_recipe_is_approved(html, report):
    assert f"SHA-256 {recipe_hash(report.recipe)[:16]}" in html


def test_the_page_loads_nothing(html):
    reader = read(html)
    assert not {tag for tag, _ in reader.elements} & {"link", "iframe", "object", "embed", "base", "form", "img"}
    for _, attributes in reader.elements:
        for name, value in attributes.items():
            assert not name.startswith("on")
            if name in ("src", "href", "xlink:href", "action", "data", "srcset"):
                assert value.startswith(("#", "data:image/png;base64,"))
    assert "://" not in html and "url(" not in html.replace("url(#foot-", "") and "@import" not in html
    policy = next(a["content"] for t, a in reader.elements if t == "meta" and "http-equiv" in a)
    assert policy.startswith("default-src 'none'")


@pytest.mark.parametrize("odd", [np.inf, -np.inf, np.nan, 1e300])
@pytest.mark.parametrize("name", ["outline_mm", "foot_outline_mm", "initial_gap_mm", "debulked_mm"])
def test_a_report_that_reaches_to_infinity_is_named(report, name, odd):
    solved = next(p for p in report.pockets if p.debulked_mm is not None)
    values = np.array(getattr(solved, name))
    values.flat[-1] = odd
    changed = tuple(dataclasses.replace(p, **{name: values}) if p is solved else p for p in report.pockets)
    wrong = dataclasses.replace(report, pockets=changed)
    for pages in (lambda: page(wrong), lambda: stack.page([stack.Layup(wrong, "a.json")])):
        with pytest.raises(InputError, match=rf"pockets\[\d\]\.{name}: expected numbers up to 1e\+09"):
            pages()


def test_a_height_map_without_end_is_named(report):
    grid = report.height_map
    with pytest.raises(InputError, match=r"height_map\.origin_mm, spacing_mm: expected"):
        page(dataclasses.replace(report, height_map=Grid(grid.values, grid.origin_mm, 1e300)))


def test_one_script_and_no_other_may_run(html):
    """The policy names the script by its hash: what a name in the report smuggles in does not run."""
    scripts = re.findall(r"<script([^>]*)>(.*?)</script>", html, re.DOTALL)
    assert len(scripts) == 1 and "src" not in scripts[0][0]
    digest = base64.b64encode(hashlib.sha256(scripts[0][1].encode()).digest()).decode()
    assert f"script-src 'sha256-{digest}'" in html
    assert "unsafe-inline" not in html.replace("style-src 'unsafe-inline'", "")
    for danger in ("eval(", "fetch(", "XMLHttpRequest", "import(", "innerHTML = location"):
        assert danger not in scripts[0][1]


def test_everything_is_escaped(html):
    assert html.count("<script") == 1
    assert "&lt;script&gt;alert(&#39;x&#39;)&lt;/script&gt; &amp; less" in html
    assert "scan &lt;1&gt;.pcd" in html


def test_the_page_shows_every_pocket_and_figure(report, html):
    text = " ".join(" ".join(read(html).text).split())
    assert text.index("INVALID") < text.index("pocket 6 cannot be judged") < text.index("Map of the ply")
    for pocket in report.pockets:
        assert f"Pocket {pocket.id}" in text
        assert f"{pocket.area_mm2 / 100:.2f}" in text
        if pocket.rms_mm is not None:
            assert f"{pocket.rms_mm:.3f}" in text
            assert f"{0.3 - pocket.rms_mm:+.3f}".replace("-", "−") in text
            assert f" {pocket.solve.evaluations} " in text
    for part in ("residual force", "1243 points", "the ply's edge is nearer", "98.7", "node_target", "(default 100)"):
        assert part in text
    for stage in report.timings_ms:
        assert stage in text


def test_outlines_carry_number_and_sign_besides_colour(report, html):
    labels = re.findall(r'<text class="label"[^>]*>(\d+) (.)</text>', html)
    assert labels == [("1", "✓"), ("2", "✓"), ("3", "✕"), ("4", "?"), ("5", "✕"), ("6", "∅"), ("7", "✕")]


def test_the_page_is_small_and_deterministic(report, html):
    assert len(html.encode()) < 5_000_000
    assert page(report) == html


@pytest.mark.slow
def test_a_large_noisy_report_stays_below_5_mb(report):
    heights = np.random.default_rng(0).normal(5, 4, (3000, 4000)).astype(np.float32)
    pockets = tuple(dataclasses.replace(report.pockets[k % 5], id=k + 1) for k in range(150))
    large = dataclasses.replace(report, height_map=Grid(heights, np.zeros(2), 0.3), pockets=pockets)
    html = page(large)
    assert len(html.encode()) < 5_000_000
    assert "left out to keep the page small" in html
    assert html.index("data-net") < html.index('class="net" role="img" aria-label="Net of pocket 150')
    read(html)


def test_what_has_to_be_left_out_is_left_out_of_the_harmless_first(report):
    pockets = tuple(dataclasses.replace(report.pockets[k % 5], id=k + 1) for k in range(150))
    drawings = _drawings(dataclasses.replace(report, pockets=pockets))
    still = {pocket.verdict for pocket in pockets if pocket.id in drawings and drawings[pocket.id].still}
    assert Verdict.CREASE in still and Verdict.CEASE not in still


@pytest.mark.parametrize("verdict", list(Verdict))
def test_a_report_with_nothing_in_it_has_a_page(verdict):
    assert verdict.name in "".join(read(page(Report(verdict=verdict, reason="nothing raised", pockets=()))).text)


def test_the_picture_lies_where_the_outlines_lie():
    """A single high cell, its position read back from the picture."""
    values = np.zeros((30, 50), np.float32)
    values[4, 40] = 8.0
    values[20:, :10] = np.nan
    report = Report(
        verdict=Verdict.CEASE, reason="", pockets=(), height_map=Grid(values, np.array([100.0, 200.0]), 2.0)
    )
    drawn = ply_map(report.height_map, None, [], None)
    assert drawn.top_mm == pytest.approx(0.1)  # a thousandth of the cells is not looked at
    picture = cv2.imdecode(np.frombuffer(base64.b64decode(drawn.image), np.uint8), cv2.IMREAD_UNCHANGED)
    assert picture.shape == (30, 50, 4)
    x, y, width, height = drawn.image_box
    row, column = np.unravel_index(np.argmax(picture[..., 2]), picture.shape[:2])
    assert x + (column + 0.5) * width / 50 == pytest.approx(180.0)
    assert -(y + (row + 0.5) * height / 30) == pytest.approx(208.0)
    assert picture[0, 0, 3] == 0 and picture[29, 0, 3] == 255  # north-west was not seen


def test_a_cropped_picture_keeps_its_place(report):
    drawn = ply_map(report.height_map, np.array([[400.0, 300], [800, 300], [800, 700]]), [], 15.0)
    x, y, width, height = drawn.image_box
    assert drawn.x - 2 < x + 1 < 400 and 800 < x + width < 850
    assert -700 - 50 < y < -700 and y + height > -300


def test_labels_keep_off_their_neighbours():
    square = np.array([[0, 0], [8, 0], [8, 8], [0, 8]], dtype=float)
    crowd = [square + np.array(shift) for shift in ((0, 0), (12, 0), (24, 0), (500, 300), (12, 30))]
    places = labels(crowd, 10.0, np.array([-40.0, -40.0]), np.array([510.0, 310.0]))
    boxes = [label_box(x, -y + 3.5, anchor, 10.0) for x, y, anchor in places]
    squares = [np.concatenate([s.min(axis=0), s.max(axis=0)]) for s in crowd]
    for k, box in enumerate(boxes):
        assert all(overlap(box, other) == 0 for other in squares + boxes[:k])
        assert (box[:2] >= -40).all() and (box[2:] <= [510, 310]).all()


def test_a_total_among_the_times_is_not_a_stage(report):
    text = " ".join(read(page(dataclasses.replace(report, timings_ms={"a": 10.0, "b": 20.0, "total": 31.0}))).text)
    assert "31 ms in all" in text and " total " not in text


def test_margins_are_positive_inside():
    assert margin(0.25, 0.3) == pytest.approx(0.05)
    assert margin(0.35, 0.3) == pytest.approx(-0.05)
    assert margin(None, 0.3) is None and margin(0.3, None) is None


def test_the_margin_of_a_ridge_is_that_of_the_most_it_may_be(report):
    """A pocket that closes only if its rim slips has no margin, though the ridge shown first is none."""
    one = dataclasses.replace(report.pockets[0], decided_by="ridge", ridge_height_mm=0.0, ridge_range_mm=(0.0, 0.86))
    text = "".join(read(page(dataclasses.replace(report, pockets=(one,)))).text)
    assert "0.00 (0.00 to 0.86)−0.26" in text


def test_nets_are_drawn_at_one_scale_with_their_kinds(report):
    views = net_views(report.pockets[6], 0.6, [0, 1, 2])
    before, after, coarse = views.views
    net = report.pockets[6].net
    for view in views.views:
        read(view.markup)
        assert view.markup.count('class="fixed"') == np.sum(net.kinds == 1)
        assert view.markup.count('class="free"') == np.sum(net.kinds == 2) > 0
        assert view.markup.count("<circle") == np.sum(net.kinds == 0)
        assert view.markup.count('class="section"') == 1
    assert before.high_mm == pytest.approx(report.pockets[6].initial_gap_mm.max())
    assert after.high_mm == pytest.approx(report.pockets[6].post_processed_gap_mm.max())
    assert coarse.high_mm == pytest.approx(report.pockets[6].debulked_gap_mm.max())
    assert [view.coarse for view in views.views] == [False, False, True]
    assert views.top_mm == pytest.approx(max(before.high_mm, after.high_mm, coarse.high_mm), abs=0.01)
    assert [view.lift for view in views.views] == [1, after.lift, 1]
    # Nothing is drawn outside the frame.
    for u, v in re.findall(r"[ML](-?\d+\.\d) (-?\d+\.\d)", before.markup + after.markup + coarse.markup):
        assert 0 <= float(u) <= WIDTH and 0 <= float(v) <= HEIGHT


def test_a_ridge_after_debulking_is_seen_beside_a_high_pocket(report):
    """A ridge of twice the limit has the scale's last colour, and is drawn higher than by the pocket's scale."""
    pocket = report.pockets[0]
    gap = np.full(len(pocket.net.nodes_mm), 0.25)
    gap[np.argmax(pocket.initial_gap_mm)] = 2.0
    before, after, _ = net_views(dataclasses.replace(pocket, post_processed_gap_mm=gap), 0.6).views
    assert before.high_mm > 14 and after.lift >= 5
    assert set(re.findall(r'fill="(#\w+)"', after.markup)) <= set(ridge_colours(32))
    assert ridge_colours(32)[-1] in after.markup and ridge_colours(32)[-1] not in before.markup
    below, above = (rgb(colour) for colour in ridge_colours(32)[15:17])
    assert below[2] > below[0] and above[0] > above[2]  # blue up to the limit, orange from there


def rgb(colour):
    return [int(colour[k : k + 2], 16) for k in (1, 3, 5)]


def test_every_segment_is_drawn_once_as_a_cells_side_or_alone(report):
    net = report.pockets[0].net
    data = json.loads(net_views(report.pockets[0], 0.6).data)
    cells = np.array(data["cells"]).reshape(-1, 4)
    sides = {tuple(sorted((c[k], c[k - 1]))) for c in cells.tolist() for k in range(4)}
    loose = {tuple(sorted(edge)) for edge in np.array(data["loose"]).reshape(-1, 2).tolist()}
    assert not sides & loose
    assert sides | loose == {tuple(sorted(edge)) for edge in net.edges.tolist()}


def test_the_height_before_follows_from_the_mold_where_it_is_not_given(report):
    pocket = report.pockets[0]
    without = net_views(dataclasses.replace(pocket, initial_gap_mm=None), 0.6)
    assert without.views[0].high_mm == pytest.approx(pocket.initial_gap_mm.max())


def test_the_section_runs_along_the_whole_fibre_through_the_ridge(report):
    pocket = report.pockets[1]
    net = pocket.net
    inner = int(np.argmax(np.where((net.neighbours >= 0).all(axis=1), pocket.post_processed_gap_mm, 0)))
    ridge = np.array([net.neighbours[inner, 3], inner, net.neighbours[inner, 2]])
    drawn = profile(dataclasses.replace(pocket, ridge_nodes=ridge), report.recipe)
    read(drawn.markup)
    assert drawn.through_ridge and drawn.fibre == 1
    assert set(ridge.tolist()) < set(drawn.nodes)
    assert net.neighbours[drawn.nodes[0], 3] == net.neighbours[drawn.nodes[-1], 2] == -1
    assert all(net.neighbours[a, 2] == b for a, b in itertools.pairwise(drawn.nodes))
    standing = pocket.post_processed_gap_mm[drawn.nodes] > 0.25 + 0.02
    assert drawn.markup.count('class="ridge"') == np.sum(standing) > 0
    for u, v in re.findall(r"[ML](-?\d+\.\d) (-?\d+\.\d)", drawn.markup):
        assert 0 <= float(u) <= WIDTH and 0 <= float(v) <= HEIGHT


def test_heights_of_the_section_are_to_the_scale_that_is_said(report):
    """Read back from the drawing: the net's gaps over its lengths, exaggerated as said."""
    pocket = report.pockets[2]
    drawn = profile(pocket, report.recipe)
    curves = re.findall(r'class="(before|net-after)" d="([^"]+)"', drawn.markup)
    before, after = (
        np.array(re.findall(r"(\S+) (\S+)", d.replace("M", "").replace("L", "\n")), float) for _, d in curves
    )
    gaps = pocket.initial_gap_mm[drawn.nodes] - pocket.debulked_gap_mm[drawn.nodes]
    points = pocket.net.nodes_mm[drawn.nodes]
    scale = np.ptp(before[:, 0]) / np.hypot(*(points[-1] - points[0])[:2])
    assert after[:, 1] - before[:, 1] == pytest.approx(gaps * scale * drawn.exaggeration, abs=0.15)
    assert not drawn.through_ridge  # the report says of no ridge where it is: then through the highest node
    assert int(np.argmax(pocket.initial_gap_mm)) in drawn.nodes


def test_there_is_no_drawing_without_a_net(report):
    assert net_views(report.pockets[5], 0.6) is None
    assert profile(report.pockets[5], {}) is None


def test_colours_run_from_dark_to_light():
    light = [sum(int(c[k : k + 2], 16) * w for k, w in ((1, 0.3), (3, 0.59), (5, 0.11))) for c in colours(16)]
    assert all(a < b for a, b in itertools.pairwise(light))


def test_the_bars_of_the_rms_start_at_its_floor(report):
    """The consolidated ply, 0.3 mm over 1.2, is the RMS of a ply that lies flat; the limit stands above it."""
    text = " ".join(" ".join(read(page(report)).text).split())
    assert "bars start at 0.250 mm" in text
    rows = [Row(1, Verdict.CEASE, 0.25), Row(2, Verdict.CREASE, 0.35, (0.3, 0.35)), Row(3, Verdict.CEASE, 0.2)]
    chart = bar_chart("", rows, 0.30, 3, floor=0.25)
    assert [bar.percent for bar in chart.bars] == pytest.approx([0.0, 100.0, 0.0])
    assert chart.limit_percent == pytest.approx(50.0) and chart.bars[1].low == pytest.approx(50.0)


def test_pockets_link_to_the_map_and_back(report, html):
    targets = {a["id"] for _, a in read(html).elements if "id" in a}
    links = {a["href"].removeprefix("#") for _, a in read(html).elements if a.get("href", "").startswith("#")}
    assert links <= targets
    for pocket in report.pockets:
        assert {f"map-{pocket.id}", f"pocket-{pocket.id}"} <= links


def test_the_map_marks_holes_bumps_and_fibres_in_their_places(report):
    hole = UnseenHole(
        centre_mm=(500.0, 200.0), extent_mm=(60, 20), area_mm2=900, thickness_mm=20, rim_height_mm=0.3, of="scan"
    )
    bump = LeftOut(what="bump", why="no pocket", place_mm=(700.0, 90.0))
    marked = dataclasses.replace(report, unseen=(hole,), left_out=(bump, *report.left_out))
    drawn = ply_map(marked.height_map, marked.ply_outline_mm, [], None, marked)
    assert [(s.x, s.y) for s in drawn.holes] == [(500.0, -200.0)] and "(500, 200)" in drawn.holes[0].title
    ends = np.array(re.findall(r"[ML](-?\d+\.\d) (-?\d+\.\d)", drawn.holes[0].path), float)
    assert np.hypot(ends[:, 0] / 30, ends[:, 1] / 10) == pytest.approx(np.ones(14), abs=0.02)
    assert [(s.x, s.y) for s in drawn.bumps] == [(700.0, -90.0)]
    # The made-up nets' fibres run along (1, -0.08) and (0.12, 1).
    assert len(drawn.fibres) == sum(p.net is not None for p in report.pockets)
    assert all(s.title.endswith(": -5°, 83°") for s in drawn.fibres)
    assert all(t.at == float(t.text.replace("−", "-")) for t in drawn.x_ticks) and len(drawn.x_ticks) > 3
    assert all(-t.at == float(t.text.replace("−", "-")) for t in drawn.y_ticks) and len(drawn.y_ticks) > 3


def test_the_banner_names_the_pockets_that_decide(report, html):
    text = " ".join(" ".join(read(html).text).split())
    assert (
        text.index("part A-17") < text.index("ply 3 · ") < text.index("2026-03-01 12:00:00 UTC") < text.index("INVALID")
    )
    assert "pockets 3 , 5 , 7 CREASE" in text and "pocket 4 UNDECIDED" in text
    assert text.index("pockets 3 , 5 , 7 CREASE") < text.index("Smooth the ply") < text.index("Map of the ply")


def test_a_bridge_above_the_ridge_is_what_the_table_shows(report):
    one = next(p for p in report.pockets if p.ridge_height_mm)
    assert one.deciding_ridge.height_mm == one.ridge_height_mm
    ridge = dataclasses.replace(one, bridge_height_mm=9.0, decided_by="paper").deciding_ridge
    assert ridge == (9.0, (9.0, 9.0), "bridge of the net") and ridge.spread == ""
    section = BridgeSection(
        height_mm=8.0,
        range_mm=(7.5, 8.5),
        lacks_mm=0.4,
        lacks_error_mm=0.04,
        pull_n_per_mm=3.0,
        hold_n_per_mm=9.0,
    )
    weighed = dataclasses.replace(one, bridge_height_mm=9.0, bridge_section=section)
    ridge = weighed.deciding_ridge
    assert ridge == (8.0, (7.5, 8.5), "bridge") and ridge.spread == "(7.50 to 8.50)"
    assert ridge.margin_mm(0.6) == pytest.approx(-7.9)


@pytest.mark.parametrize("verdict", [Verdict.INVALID, Verdict.UNDECIDED])
def test_a_page_explains_every_check_that_found_something_and_links_to_it(verdict):
    """Banner, checklist and table lead to what the check looks at, its limit, and what to do; nothing leads outside."""
    names = [*(text.name for text in CHECK_TEXTS), "of a later version"]
    found = tuple(Finding(name, verdict, f"found by {name}") for name in names)
    shown = read(page(Report(verdict=verdict, reason="found by chain", pockets=(), findings=found)))
    text = " ".join(" ".join(shown.text).split()).replace(" .", ".")
    for check in CHECK_TEXTS:
        for said in (check.title, check.sees, check.limit, check.remedy):
            assert " ".join(said.replace("`", " ").split()).replace(" ,", ",") in text.replace(" ,", ",")
    assert "This version of debulk has no check of that name." in text
    ids = {a["id"] for _, a in shown.elements if "id" in a}
    links = [a["href"] for _, a in shown.elements if a.get("href", "").startswith("#check-")]
    assert links[0] == "#check-chain" and {f"#check-{name}" for name in names} == set(links)
    assert {link[1:] for link in links} <= ids
