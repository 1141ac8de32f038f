from frobs_cli.parameters import descriptions, parameters


class Parent:
    """A parent.

    Args:
        shared: Of both [m].
        hidden: Overridden below.
    """

    def __init__(self, *, shared: float = 1.0, hidden: int = 2) -> None: ...


class Child(Parent):
    """A child.

    Some text with a colon: that is no parameter.

    Args:
        own (int): Its own, on
            two lines, with ``code``.
        hidden: Said anew.

    Attributes:
        kept: What it keeps.

    Raises:
        ValueError: Never.
    """

    def __init__(self, own: int, *, hidden: int = 3, **rest: float) -> None: ...


class Closed(Parent):
    """Passes nothing on."""

    def __init__(self, *, only: str = "x") -> None: ...


def test_parameters_come_from_the_constructor_and_those_it_passes_on_to() -> None:
    assert [(row["name"], row["required"], row["default"]) for row in parameters(Child)] == [
        ("own", True, None),
        ("hidden", False, 3),
        ("shared", False, 1.0),
    ]


def test_a_constructor_that_passes_nothing_on_hides_its_parents() -> None:
    assert [row["name"] for row in parameters(Closed)] == ["only"]


def test_meanings_come_from_the_docstrings_the_nearest_class_first() -> None:
    assert descriptions(Child) == {
        "own": "Its own, on two lines, with code.",
        "hidden": "Said anew.",
        "kept": "What it keeps.",
        "shared": "Of both [m].",
    }


def test_a_class_without_docstring_or_constructor_has_none() -> None:
    assert parameters(type("Bare", (), {})) == []
