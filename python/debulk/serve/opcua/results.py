"""Results and recipes in the types of OPC 40100-1, which `asyncua` makes from the standard's nodeset."""

from __future__ import annotations

from datetime import datetime
from typing import Any

from asyncua import ua

from debulk.serve.result import Result
from debulk.verdict import Verdict

FIELDS = (
    "ResultId", "IsPartial", "ResultState", "MeasId", "PartId", "InternalRecipeId", "InternalConfigurationId", "JobId",
    "CreationTime", "ProcessingTimes", "ResultContent",
)  # fmt: skip
"""Fields of a result that are filled in, in the order of the standard."""

EVALUATION = {Verdict.INVALID.name: 0, Verdict.CEASE.name: 1, Verdict.CREASE.name: 2, Verdict.UNDECIDED.name: 3}
"""ResultEvaluationEnum of OPC 40001-101: 0 undefined, 1 OK, 2 not OK, 3 not decidable."""

_COMPLETED, _FAILED = 1, 4  # ResultStateDataType


def evaluation(result: Result) -> int:
    """Return the value of a result in ResultEvaluationEnum."""
    return EVALUATION[result.verdict]


def recipe_id(sha256: str) -> Any:
    """Return the identity of a recipe: its hash, so that no other recipe can have it."""
    return ua.RecipeIdInternalDataType(Id=sha256[:16], Hash=bytes.fromhex(sha256), HashAlgorithm="SHA-256")


def job_id(number: str) -> ua.Variant:
    """Return the identity of a job."""
    return ua.Variant(ua.JobIdDataType(Id=number))


def variant(field: str, value: Any) -> ua.Variant:
    """Return a field of a result with the type that the standard gives it, where the value does not tell it."""
    if field == "ResultContent":
        return ua.Variant(value or [], ua.VariantType.Variant, is_array=True)
    return ua.Variant(value, ua.VariantType.Int32) if field == "ResultState" else ua.Variant(value)


def result_data(result: Result, job: str, meas_id: str) -> Any:
    """Return a result of a job.

    Its content is the evaluation (Int32), the verdict, the reason, and each entry of the checklist as text.
    """
    began, ended = (datetime.fromisoformat(text) for text in (result.received_utc, result.finished_utc))
    texts = [result.verdict, result.reason, *map(str, result.do)]
    return ua.ResultDataType(
        ResultId=ua.ResultIdDataType(Id=result.id),
        IsPartial=False,
        ResultState=_FAILED if result.refused else _COMPLETED,
        MeasId=ua.MeasIdDataType(Id=meas_id),
        PartId=ua.PartIdDataType(Id=result.part),
        InternalRecipeId=recipe_id(result.recipe),
        InternalConfigurationId=ua.BinaryIdBaseDataType(Id=result.inspector),
        JobId=ua.JobIdDataType(Id=job),
        CreationTime=ended,
        ProcessingTimes=ua.ProcessingTimesDataType(
            StartTime=began, EndTime=ended, ProcessingDuration=1e3 * result.seconds
        ),
        ResultContent=[
            ua.Variant(evaluation(result), ua.VariantType.Int32),
            *(ua.Variant(text, ua.VariantType.String) for text in texts),
        ],
    )
