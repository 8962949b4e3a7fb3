"""The page of two reports: what differs stands first, and every link leads somewhere."""

import dataclasses

from debulk.page.difference import page
from debulk.report import Report
from debulk.results.difference import places
from debulk.verdict import Verdict
from html_reader import read


def other(report):
    """Return a report in which a pocket creases, one is gone, and a setting differs."""
    pockets = list(report.pockets)
    pockets[0] = dataclasses.replace(
        pockets[0], verdict=Verdict.CREASE, excess=None, ridge_height_mm=0.9, ridge_range_mm=None
    )
    recipe = {**report.recipe, "net": {**report.recipe["net"], "node_target": 100}}
    return dataclasses.replace(
        report, verdict=Verdict.CREASE, pockets=tuple(pockets[:6]), recipe=recipe, findings=(), trace=None
    )


def rows(html):
    lines = html[html.index("<tbody>") : html.index("</tbody>")].split("<tr>")[1:]
    return [[" ".join(cell.split()) for cell in read(f"<tr>{line}").text if cell.strip()] for line in lines]


def test_what_differs_comes_first_with_both_ridges_and_the_change(report):
    html = page(report, other(report), ("a.json", "b.json"))
    shown = rows(html)
    signs = [row[0] for row in shown]
    assert signs == sorted(signs, reverse=True) and signs.count("≠") == 2
    assert [place.differs for place in places(report, other(report))].count(True) == 2
    first = next(row for row in shown if row[1] == "1")
    was = report.pockets[0].deciding_ridge.height_mm
    assert "✓ CEASE" in first and "✕ CREASE" in first and "0.90" in first and f"{0.9 - was:+.2f}" in first
    gone = next(row for row in shown if "not there" in row)
    assert gone[:3] == ["≠", "7", "–"]
    text = " ".join(" ".join(read(html).text).split())
    assert "INVALID, then CREASE" in text and "net.node_target 90 100" in text
    assert "2 of 7 places differ, 1 setting of the recipe" in text
    assert "not known whether the same" in text


def test_a_report_beside_itself_differs_in_nothing(report):
    text = " ".join(" ".join(read(page(report, report)).text).split())
    assert "Both INVALID 0 of 7 places differ, no settings of the recipe" in text
    assert "None: both were made with the same recipe." in text and "the same, by fingerprint" in text
    flat = Report(verdict=Verdict.CEASE, reason="flat", pockets=())
    assert "0 of 0 places differ" in " ".join(" ".join(read(page(flat, flat)).text).split())


def test_every_link_leads_to_a_place_of_its_own(report):
    elements = read(page(report, other(report))).elements
    ids = [a["id"] for _, a in elements if "id" in a]
    links = {a["href"] for _, a in elements if "href" in a and not a["href"].startswith("data:")}
    assert len(set(ids)) == len(ids)
    assert {link[1:] for link in links} <= set(ids) and {"#map-1-7", "#map-2-1"} <= links
