"""The page of the rules by which model files are read."""

from frobs_core.models import RULES, Treatment
from generate.rst import code, heading, label, table


def page() -> str:
    """Return the page."""
    text = label("model-rules") + heading("Rules for model files")
    text += (
        "What is not built as the file says it is noted in ``RobotModel.notes``, each note with the name of one of these "
        "rules; ``frobs doctor robot FILE`` shows them. Files whose author should mend something fail ``frobs check`` of "
        "a robot.\n\n"
    )
    for treatment in Treatment:
        rows = [
            (code(rule.name), _inline(rule.about), _inline(rule.text), "yes" if rule.fault else "")
            for rule in RULES.values()
            if rule.treatment is treatment
        ]
        text += heading(treatment.value.capitalize(), "-")
        text += table(["rule", "what the file says", "what is done", "to be mended"], rows)
    return text


def _inline(text: str) -> str:
    """Return Markdown's code as reStructuredText's."""
    return text.replace("`", "``")
