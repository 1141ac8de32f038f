"""Plugin records of this distribution."""

from frobs_core.plugins.hooks import hookimpl
from frobs_core.plugins.records import PolicyRecord, ViewerRecord


@hookimpl
def frobs_extensions() -> list[PolicyRecord | ViewerRecord]:
    """Return the records of the viewer and of the policies through which a person acts."""
    hint = "pip install frobs-view"
    policies = [
        PolicyRecord(name=name, summary=summary, entry_point=f"frobs_view.teleop:{cls}", install_hint=hint)
        for name, cls, summary in (
            ("teleop", "Teleop", "a person who drags a handle in the browser"),
            ("teleop:keyboard", "KeyboardTeleop", "a person at the keyboard, in the browser"),
            ("teleop:gamepad", "GamepadTeleop", "a person with a gamepad, in the browser"),
        )
    ]
    return [
        *policies,
        ViewerRecord(
            name="browser",
            summary="a page in the browser, with any simulator",
            entry_point="frobs_view.viewer:BrowserViewer",
            install_hint=hint,
        ),
    ]
