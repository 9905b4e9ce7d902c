"""A check as JUnit XML, which every CI shows: a test case for each finding."""

from __future__ import annotations

from xml.etree import ElementTree

from kilauea.checking.judge import Verdict
from kilauea.checking.report.record import Subject
from kilauea.checking.run import Outcome


def as_junit(outcome: Outcome, subject: Subject, seconds: float) -> bytes:
    """Write the findings; a check that is inconclusive fails, for it proves nothing."""
    findings = outcome.findings
    suite = ElementTree.Element(
        "testsuite",
        name="kilauea check",
        timestamp=subject.date[:19],
        time=f"{seconds:.3f}",
        tests=str(len(findings)),
        failures=str(sum(f.verdict is not Verdict.PASS for f in findings)),
        errors="0",
        skipped="0",
    )
    properties = ElementTree.SubElement(suite, "properties")
    for name, value in {**subject.versions, "command": subject.command}.items():
        ElementTree.SubElement(properties, "property", name=name, value=_printable(str(value)))
    for finding in findings:
        case = ElementTree.SubElement(
            suite, "testcase", classname=_printable(subject.stage), name=finding.name, time="0"
        )
        if finding.verdict is not Verdict.PASS:
            failure = ElementTree.SubElement(
                case, "failure", type=finding.verdict.value, message=_printable(finding.summary)
            )
            failure.text = f"{finding.title}: {_printable(finding.summary)}"
        else:
            ElementTree.SubElement(case, "system-out").text = _printable(finding.summary)
    return ElementTree.tostring(suite, encoding="utf-8", xml_declaration=True)


def _printable(text: str) -> str:
    """Drop control characters, which XML cannot hold."""
    return "".join(c for c in text if c.isprintable())
