"""The published JSON Schema is that of the dataclasses, and what is saved keeps it."""

import copy
import gzip
import json
from pathlib import Path

import jsonschema
import pytest

from debulk import results
from debulk.comparison import Comparison
from debulk.results import codec
from debulk.results.codec import SCHEMA, encode
from debulk.results.comparison import FORMAT
from lab import json_schema

PUBLISHED = Path(results.__file__).with_name("schema")
OLD = Path(__file__).with_name("old")


@pytest.mark.parametrize("what", json_schema.RECORDS)
def test_the_published_schema_is_that_of_the_records(what):
    published = json.loads((PUBLISHED / f"{what}.schema.json").read_text())
    assert published == json_schema.json_schema(what), "run python -m lab.json_schema on its folder"
    jsonschema.Draft202012Validator.check_schema(published)


@pytest.mark.parametrize("what", json_schema.RECORDS)
def test_an_old_record_that_was_brought_to_the_present_keeps_it(what):
    """It has every part that a record could have."""
    old = json.loads(gzip.decompress((OLD / f"{what}_{SCHEMA - 1}.json.gz").read_bytes()))
    kind, name = json_schema.RECORDS[what]
    record = codec.loads(kind, json.dumps(old).encode(), name)
    jsonschema.validate(json.loads(json.dumps(encode(record, name))), json_schema.json_schema(what))


def test_a_report_keeps_it_and_an_edited_one_does_not(report):
    validator = jsonschema.Draft202012Validator(json_schema.json_schema("report"))
    tree = json.loads(json.dumps(report.to_dict()))
    validator.validate(tree)
    tree["pockets"] = tree["pockets"][:1]
    for edit in (
        lambda t: t.update(schema=SCHEMA - 1),
        lambda t: t.update(verdict="good"),
        lambda t: t["pockets"][0].update(rms_mm="0.3"),
        lambda t: t["pockets"][0].pop("id"),
        lambda t: t["pockets"][0].update(more=1),
        lambda t: t["pockets"][0]["outline_mm"].append([1.0]),
        lambda t: t["height_map"].pop("values"),
    ):
        wrong = copy.deepcopy(tree)
        assert validator.is_valid(wrong)
        edit(wrong)
        assert not validator.is_valid(wrong)


def test_an_empty_comparison_keeps_it():
    tree = encode(Comparison(pockets=(), max_rms_mm=0.3, max_peak_mm=0.6), FORMAT)
    jsonschema.validate(json.loads(json.dumps(tree)), json_schema.json_schema("comparison"))
