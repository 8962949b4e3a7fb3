"""The page of several layups: which comes first, where its links lead."""

import dataclasses

import numpy as np
import pytest

from debulk import Grid
from debulk.page.stack import Layup, page
from debulk.report import Report
from debulk.results.trace import Trace
from debulk.verdict import Verdict
from html_reader import read


def layup(verdict, name, link="", **context):
    trace = Trace(time_utc=f"2026-03-01T12:00:{len(name):02d}.5Z", context=context)
    return Layup(Report(verdict=verdict, reason=f"of {name}", pockets=(), trace=trace), name, link)


def order(html, *texts):
    places = [html.index(text) for text in texts]
    return places == sorted(places)


def test_the_worst_ply_heads_the_table_and_the_sections_go_ply_by_ply():
    html = page([
        layup(Verdict.CEASE, "ten.json", ply=10, part="A-17"),
        layup(Verdict.CREASE, "nine.json", ply="9", part="A-17"),
        layup(Verdict.UNDECIDED, "two.json", ply=2, part="A-17"),
    ])  # fmt: skip
    table, sections = html[html.index("<table") : html.index("</table>")], html[html.index("</table>") :]
    assert order(table, "nine.json", "two.json", "ten.json")
    assert order(sections, "<h2>Ply 2", "<h2>Ply 9", "<h2>Ply 10")
    text = " ".join(" ".join(read(html).text).split())
    assert "CREASE 3 plies of part A-17: 1 CREASE, 1 UNDECIDED, 1 CEASE" in text
    assert order(text, "✕ Ply 9 CREASE", "? Ply 2 UNDECIDED", "Plies, the worst")


def test_plies_of_several_parts_are_named_with_their_part_and_go_part_by_part():
    html = page([
        layup(Verdict.CEASE, "b1.json", ply=1, part="B"),
        layup(Verdict.CEASE, "a2.json", ply=2, part="A"),
        layup(Verdict.CREASE, "a1.json", ply=1, part="A"),
    ])  # fmt: skip
    sections = html[html.index("</table>") :]
    assert order(sections, "<h2>A, ply 1", "<h2>A, ply 2", "<h2>B, ply 1")
    text = " ".join(" ".join(read(html).text).split())
    assert "3 plies of parts A, B: 1 CREASE, 2 CEASE" in text and "✕ A, ply 1 CREASE" in text


def test_without_numbers_the_given_order_stays():
    html = page([layup(Verdict.CEASE, "b.json"), layup(Verdict.CEASE, "a.json", ply=1)])
    assert order(html[html.index("</table>") :], "b.json", "a.json")
    assert "Layup 1" in html and "Ply 1" in html


def test_links_lead_to_sections_pockets_and_files(report):
    html = page([Layup(report, "first.json", "sub/first.html"), Layup(report, "second.json")])
    elements = read(html).elements
    ids = [a["id"] for _, a in elements if "id" in a]
    links = [a["href"] for _, a in elements if "href" in a and not a["href"].startswith("data:")]
    assert len(set(ids)) == len(ids)
    assert {link[1:] for link in links if link.startswith("#")} <= set(ids)
    assert {link for link in links if not link.startswith("#")} == {"sub/first.html"}
    for ply in (1, 2):
        assert f"#ply-{ply}" in links
        for pocket in report.pockets:
            assert {f"#map-{ply}-{pocket.id}", f"#pocket-{ply}-{pocket.id}"} <= set(links)


@pytest.mark.slow
def test_a_page_of_many_plies_stays_small(report):
    heights = np.random.default_rng(0).normal(5, 4, (900, 1200)).astype(np.float32)
    noisy = dataclasses.replace(report, height_map=Grid(heights, np.zeros(2), 1.0))
    html = page([Layup(noisy, f"{k}.json") for k in range(12)])
    assert len(html.encode()) < 6_000_000 and html.count("<image") == 12


@pytest.mark.parametrize("count", [1, 3])
def test_all_text_is_escaped(report, count):
    evil = "</title><script>alert(1)</script>"
    trace = dataclasses.replace(report.trace, context={"part": evil, "ply": evil})
    html = page([Layup(dataclasses.replace(report, trace=trace, reason=evil), evil, evil)] * count)
    assert html.count("<script") == 1 and "alert(1)</script>" not in html
    read(html)
