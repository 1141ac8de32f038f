"""The page of the rules by which model files are read."""

from frobs_core.models import Treatment
from frobs_models import RULES
from generate.rst import code, heading, label, table


def page() -> str:
    """Return the page."""
    text = label("model-rules") + heading("Rules for model files")
    text += (
        "If FRobs does not build an element as the model file describes it, it adds a note to ``RobotModel.notes``. Each "
        "note contains the name of one of these rules, and ``frobs doctor robot FILE`` prints the notes. If a file contains "
        "a fault that its author should fix, ``frobs check`` fails for the robot.\n\n"
    )
    for treatment in Treatment:
        rows = [
            (code(rule.name), _inline(rule.about), _inline(rule.text), "yes" if rule.fault else "")
            for rule in RULES.values()
            if rule.treatment is treatment
        ]
        text += heading(treatment.value.capitalize(), "-")
        text += table(["rule", "content of the file", "treatment", "should be fixed"], rows)
    return text


def _inline(text: str) -> str:
    """Return Markdown's code as reStructuredText's."""
    return text.replace("`", "``")
