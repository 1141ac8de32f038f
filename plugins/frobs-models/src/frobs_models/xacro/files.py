"""Expands xacro files without ROS.

The PyPI package ``xacro`` expands the macros, but FRobs replaces its evaluation of expressions and its file access.
Only the package's handling of elements, macros and properties is used. Expressions are evaluated by
:class:`frobs_models.xacro.expressions.Interpreter`, files are opened by :func:`frobs_core.util.files.read_limited`, and
the amount of work is limited. Each expansion uses its own copy of the package's module, so that no file affects the
expansion of another file. A file can read environment variables (``$(env …)``) and YAML files.
"""

from __future__ import annotations

import fnmatch
import keyword
import logging
import os
import re
from collections import ChainMap
from collections.abc import Callable, Iterator, Mapping
from importlib.util import module_from_spec
from itertools import islice
from pathlib import Path
from typing import Any

from frobs_core.util.errors import ModelFileError
from frobs_core.util.files import UnsuitableFileError, read_limited
from frobs_models.budgets import BUDGETS
from frobs_models.resources import Packages
from frobs_models.xacro.errors import Declarations, choices, explain
from frobs_models.xacro.expressions import Interpreter
from frobs_models.xacro.library import eval_names, global_names
from frobs_models.xacro.limits import Budget
from frobs_models.xmltree import parse_xml, read_bytes

_log = logging.getLogger("frobs")

_BALANCED = r"(?:[^()]++|\((?:[^()]++|\((?:[^()]++|\([^()]*+\))*+\))*+\))*+"  # up to three calls in calls
_TOKENS = re.compile(
    r"(?P<escaped>\$\$+[{(])|\$\{(?P<expression>[^}]*)\}|"
    rf"\$\((?P<extension>{_BALANCED})\)|(?P<text>[^$]+|\$[^{{($]+|\$\Z)"
)
_DEFAULT = r"""\$\{.*?\}|\$\(.*?\)|(?>(?:'.*?'|".*?"|[^\s'"]+)+)|"""
_PARAMETER = re.compile(r"\s*([^\s:=]+)\s*:?=\s*(\^\|?)?(" + _DEFAULT + r")(?:\s+|$)(.*)")
_FIND = re.compile(r"\$\(\s*find\s+([^\s()]+)\s*\)")
_UNPRINTABLE = re.compile(r"[^\x20-\x7e\u00a0-\uffff]")

_MAX_PARAMETERS = 10_000
"""Maximum length of the text that declares a macro's parameters [characters]."""

_MAX_ENTRIES = 10_000
"""Maximum number of folder entries that one ``<xacro:include filename="*.xacro"/>`` examines."""

_PER_NODE, _PER_ATTRIBUTE, _PER_TAG = 10, 4, 10  # units of work per node, attribute and tag
_SIBLINGS_PER_UNIT = 12  # siblings that count as one unit of work, because replacing a node searches its siblings
_BYTES_PER_UNIT = 64
_PER_MESSAGE = 1_000


def expand_xacro(path: Path, arguments: Mapping[str, str], packages: Packages) -> str:
    """Return the expanded XML of a xacro file.

    Args:
        path: The file.
        arguments: Values of the file's ``<xacro:arg>`` elements.
        packages: Locations of packages for ``$(find …)``.

    Raises:
        ModelFileError: The file or an included file is broken, has a document type, refers to a macro, parameter,
            property, package or file that does not exist, uses an unsupported expression, or exceeds a limit. This
            error is also raised if an argument is missing or not declared.
    """
    seen = Declarations()
    xacro = _Expansion(path, seen, packages).xacro
    xacro.init_stacks(str(path))
    try:
        document = xacro.parse(None, str(path))
        xacro.process_doc(document, mappings={k: str(v) for k, v in arguments.items()}, verbosity=0)
        text = str(document.documentElement.toxml())
    except ModelFileError:
        raise
    except Exception as error:  # xacro raises many types of exceptions, including RuntimeError and KeyError
        raise explain(error, Path((xacro.filestack or [path])[-1]), seen) from error
    for name in arguments:
        if name not in seen.arguments:
            raise ModelFileError(path, f"has no xacro argument '{name}'.{choices(name, seen.arguments)}")
    return text


class _Expansion:
    """Expansion of one file and of the files that it includes, whose declarations ``seen`` collects.

    Attributes:
        xacro: A copy of the xacro module in which methods of this object replace some functions.
    """

    def __init__(self, path: Path, seen: Declarations, packages: Packages) -> None:
        from xacro.substitution_args import convert_value

        self.xacro = _copy_of_xacro()
        self._seen, self._packages, self._convert = seen, packages, convert_value
        self._budget = Budget(path)
        self._machine = Interpreter(self._budget, self.xacro.NameSpace)
        self._eval_names = eval_names(
            self._budget,
            {
                "find": self._find,
                "env": _env,
                "optenv": lambda name, default="": os.environ.get(name, default),
                "dirname": lambda _=None: self._dirname(),
                "arg": lambda name: self._converted(self._arg(name)),
            },
        )
        self._globals = global_names(self._budget, self._file_functions())
        vars(self.xacro).update(
            _global_symbols=self._globals,
            parse=self._parse,
            eval_text=self._eval_text,
            safe_eval=self._machine.evaluate,
            eval_extension=self._extension,
            get_include_files=self._include_files,
            parse_macro_arg=self._parse_parameter,
            is_valid_name=lambda name: name.isidentifier() and not keyword.iskeyword(name),
            replace_node=self._replace_node,
        )

    def _parse(self, _: Any, filename: str) -> Any:
        """Parse a file into a document that counts its copied nodes."""
        from xml.dom import minidom

        file = Path(filename)
        try:
            text = read_limited(file, BUDGETS["robot file"]["bytes"])
        except UnsuitableFileError as error:
            raise ModelFileError(file, f"cannot be read: {error.strerror}.") from error
        except OSError as error:
            self.xacro.filestack.pop()
            # <xacro:include optional="true"> ignores exceptions of this class with this cause
            raise self.xacro.XacroException(f"{error.strerror}: {file}", exc=error) from error
        self._budget.spend(_PER_TAG * text.count(b"<") + len(text) // _BYTES_PER_UNIT)
        self._budget.meter.spend("included files")
        # parse_xml rejects document types and reports the line numbers of errors
        self._seen.note(file, parse_xml(text, file), text)
        document = minidom.parseString(text)
        self._count_copies(document, minidom)
        return document

    def _count_copies(self, document: Any, minidom: Any) -> None:
        """Make a document count its copied nodes, because each macro call copies the macro's body."""
        spend = self._budget.spend

        class CountedElement(minidom.Element):  # type: ignore[misc]
            def setAttributeNS(self, *args: Any) -> None:  # noqa: N802 - name defined by DOM
                spend(_PER_ATTRIBUTE)
                super().setAttributeNS(*args)

            def setAttribute(self, name: str, value: Any) -> None:  # noqa: N802 - name defined by DOM
                super().setAttribute(name, str(value))  # the value of <xacro:attribute> can be a number

        def counted(create: Callable[..., Any]) -> Callable[..., Any]:
            def created(*args: Any) -> Any:
                spend(_PER_NODE)
                node = create(*args)
                if type(node) is minidom.Element:
                    node.__class__ = CountedElement
                return node

            return created

        for name in ("createElementNS", "createTextNode", "createComment", "createCDATASection"):
            setattr(document, name, counted(getattr(document, name)))
        for element in document.getElementsByTagName("*"):
            element.__class__ = CountedElement

    def _eval_text(self, text: str, symbols: Any) -> Any:
        """Return a text with its expressions evaluated.

        If the text consists of a single expression, the type of the expression's value is preserved.
        """
        self._budget.check_length(len(text))
        results: list[Any] = []
        at = length = 0
        while at < len(text):
            match = _TOKENS.match(text, at)
            if match is None:
                raise self.xacro.XacroException("invalid expression: " + text[at:])
            at = match.end()
            if match["escaped"]:
                value: Any = match["escaped"][1:]
            elif match["expression"] is not None:
                value = self._expression(match["expression"], symbols)
            elif match["extension"] is not None:
                value = self._extension(f"$({self._eval_text(match['extension'], symbols)})")
            else:
                value = match["text"]
            if at == len(text) and not results:
                if isinstance(value, str):  # xacro parses the text as a number and copies it
                    self._budget.check_length(len(value))
                return value
            results.append(str(value))
            length += len(results[-1])
            self._budget.spend(1)
            self._budget.check_length(len(results[-1]))
            self._budget.meter.check("characters of one text", length)
        return "".join(results)

    def _expression(self, text: str, symbols: Any) -> Any:
        try:
            return self._machine.evaluate(str(self._eval_text(text, symbols)), symbols)
        except ModelFileError:
            raise
        except Exception as error:
            raise self.xacro.XacroException(
                exc=error, suffix=f"{os.linesep}when evaluating expression '{text}'"
            ) from error

    def _extension(self, text: str) -> str:
        """Return the value of ``$(arg …)``, ``$(find …)`` or a similar substitution."""
        if text == "$(cwd)":
            return os.path.abspath(os.curdir)
        if text.startswith("$(eval "):
            return self._eval(text[len("$(eval ") : -1])
        words = text[2:-1].split()
        if not words:
            return text
        command, *given = words
        try:
            return _FIND.sub(lambda match: self._find(match[1]), self._substitute(command, given))
        except ModelFileError:
            raise
        except Exception as error:
            raise self.xacro.XacroException(f"{text}: {error}", exc=error) from error

    def _substitute(self, command: str, given: list[str]) -> str:
        if command not in ("arg", "env", "optenv", "find", "dirname"):
            raise ValueError(
                f"unknown substitution command '{command}'; available: arg, env, optenv, find, dirname, eval"
            )
        if command == "dirname":
            return self._dirname()
        if not given or (len(given) > 1 and command != "optenv"):
            raise ValueError(f"$({command} …) requires exactly one name")
        if command == "optenv":
            return os.environ.get(given[0], " ".join(given[1:]))
        return str({"arg": self._arg, "env": _env, "find": self._find}[command](given[0]))

    def _eval(self, expression: str) -> str:
        """Return the value of ``$(eval …)``, in which the file's arguments can be used as names."""
        # An argument hides a function.
        names = ChainMap(_Converted(self._arguments(), self._converted), self._eval_names)
        try:
            return str(self._machine.evaluate(expression, names))
        except ModelFileError:
            raise
        except Exception as error:
            raise self.xacro.XacroException(
                f"{type(error).__name__}: {error}", f"{os.linesep}when evaluating '{expression}'", error
            ) from error

    def _converted(self, text: str) -> Any:
        self._budget.check_length(len(text))
        return self._convert(text, "auto")

    def _arguments(self) -> dict[str, str]:
        arguments: dict[str, str] = self.xacro.substitution_args_context.get("arg", {})
        return arguments

    def _arg(self, name: str) -> str:
        self._seen.arguments.add(name)  # as in xacro, a value can be given for an argument without a declaration
        try:
            return str(self._arguments()[name])
        except KeyError as error:
            raise self.xacro.XacroException("Undefined substitution argument", exc=error) from None

    def _find(self, package: str) -> str:
        return str(self._packages.find(package))

    def _dirname(self) -> str:
        return str(Path(self.xacro.filestack[-1]).absolute().parent)

    def _file_functions(self) -> dict[str, Callable[..., Any]]:
        """Return the functions of the namespace ``xacro`` that depend on the file."""

        def fatal(*words: Any) -> None:
            raise self.xacro.XacroException(" ".join(map(str, words)))

        def message(level: int) -> Callable[..., str]:
            def write(*words: Any, **_: Any) -> str:
                self._budget.spend(_PER_MESSAGE)
                text = _UNPRINTABLE.sub("?", " ".join(map(str, words)))[:500]
                _log.log(level, "%s: %s", self.xacro.filestack[-1], text)
                return ""

            return write

        return {
            "load_yaml": self._load_yaml,
            "abs_filename": self._absolute,
            "arg": self._arg,
            "fatal": fatal,
            "message": message(logging.INFO),
            "warning": message(logging.WARNING),
            "error": message(logging.ERROR),
            "print_location": lambda: "",
        }

    def _absolute(self, name: str) -> str:
        return str(self.xacro.abs_filename_spec(name))

    def _load_yaml(self, name: str) -> Any:
        from frobs_models.xacro.yaml import load_yaml  # imported here because models without macros do not need PyYAML

        file = Path(self._absolute(name))
        try:
            return load_yaml(file, self._budget, lambda text: self._machine.evaluate(text, self._globals))
        except UnsuitableFileError as error:
            raise ModelFileError(file, f"cannot be read: {error.strerror}.") from error
        except UnicodeDecodeError as error:
            raise ValueError(f"{file} is not UTF-8 text") from error

    def _include_files(self, spec: str, symbols: Any) -> Iterator[str]:
        """Yield the paths of the files to include. ``spec`` may be a pattern."""
        name = self._absolute(str(self._eval_text(spec, symbols)))
        if not re.search(r"[*[?]", name):
            yield name
            return
        left = _MAX_ENTRIES
        paths = [Path(Path(name).anchor)]
        for part in Path(name).parts[bool(Path(name).anchor) :]:
            if not re.search(r"[*[?]", part):
                paths = [folder / part for folder in paths]
                continue
            matches = re.compile(fnmatch.translate(part)).match
            below = []
            for folder in filter(Path.is_dir, paths):
                with os.scandir(folder) as scanned:
                    entries = [entry.name for entry in islice(scanned, left)]
                left -= len(entries)
                if not left:
                    self._budget.refuse(
                        f"searching for the include '{spec}' exceeds the limit of {_MAX_ENTRIES:,} files"
                    )
                below += [folder / entry for entry in entries if matches(entry) and (entry[0] != "." or part[0] == ".")]
            paths = below
        yield from sorted(str(file) for file in paths if os.path.lexists(file))

    def _parse_parameter(self, text: str) -> tuple[str, tuple[str | None, str | None] | None, str]:
        """Return the first parameter of a macro, its default, and the rest of the text.

        The regular expression is xacro's, modified so that it cannot backtrack.
        """
        if len(text) > _MAX_PARAMETERS:
            self._budget.refuse(
                f"the parameters of a macro are longer than the limit of {_MAX_PARAMETERS:,} characters"
            )
        self._budget.spend(len(text) // 8)
        match = _PARAMETER.match(text)
        if match is None:
            name, *rest = text.lstrip().split(None, 1)
            return name, None, rest[0] if rest else ""
        name, forward, default, remaining = match.groups()
        return name, (name if forward else None, default or None), remaining

    def _replace_node(self, node: Any, by: Any, content_only: bool = False) -> None:
        """Replace a node with other nodes in one operation.

        Inserting each node separately would take quadratic time.
        """
        parent = node.parentNode
        siblings = parent.childNodes
        new: list[Any] = []
        for source in [] if by is None else by if isinstance(by, list) else [by]:
            if content_only:
                new += source.childNodes
                del source.childNodes[:]
            else:
                if source.parentNode is not None:
                    source.parentNode.removeChild(source)
                new.append(source)
        self._budget.spend(1 + len(siblings) // _SIBLINGS_PER_UNIT)
        at = siblings.index(node)
        before, after = node.previousSibling, node.nextSibling
        siblings[at : at + 1] = new
        for first, second in zip([before, *new], [*new, after], strict=True):
            if first is not None:
                first.nextSibling = second
            if second is not None:
                second.previousSibling = first
        for child in new:
            child.parentNode = parent
        node.parentNode = node.previousSibling = node.nextSibling = None


def _copy_of_xacro() -> Any:
    """Return a new copy of the xacro module, which stores its state in module globals."""
    from xacro import __spec__ as spec

    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


class _Converted(dict[str, Any]):
    """The file's arguments, which a function converts to numbers or booleans if possible."""

    def __init__(self, values: Mapping[str, str], convert: Callable[[str], Any]) -> None:
        super().__init__()
        self._values, self._convert = values, convert

    def __missing__(self, name: str) -> Any:
        return self._convert(self._values[name])


def _env(name: str) -> str:
    if name not in os.environ:
        raise ValueError(f"the environment variable '{name}' is not set")
    return os.environ[name]


def read_text(path: Path, arguments: Mapping[str, str], packages: Packages) -> tuple[bytes | str, bool]:
    """Return a model file's text, and whether macros generated the text.

    Files with the suffix ``.xacro`` are expanded. All other files are only read.

    Raises:
        ModelFileError: The file is invalid (see :func:`expand_xacro`), or arguments are passed for a file that is not a
            xacro file.
    """
    if path.suffix.lower() == ".xacro":
        return expand_xacro(path, arguments, packages), True
    if arguments:
        raise ModelFileError(
            path, f"the file cannot use xacro arguments ({', '.join(arguments)}), because it is not a .xacro file."
        )
    return read_bytes(path), False
