"""Expressions of xacro files reach numbers, texts, lists and mappings, and nothing else of the process."""

from __future__ import annotations

from itertools import product
from xml.sax.saxutils import quoteattr

import pytest

from frobs_core.models import load_model
from frobs_core.util.errors import ModelFileError

# A block parameter is an XML element. These files put one where an expression may look for it: in the scope of a macro
# that includes a namespace.
NAMESPACE = '<xacro:property name="inside" value="1"/>'
TO_THE_BLOCK = [
    "ns.parent['*b']",
    "ns['parent']['*b']",
    "ns.parent.parent['*b']",
    "ns.parent.get('*b')",
    "dict(ns.parent)['*b']",
    "list(ns.parent.values())[0]",
    "[v for k, v in ns.parent.items() if k == '*b'][0]",
    "python.max([ns.parent], key=len)['*b']",
    "python.list(map(lambda n: n.parent['*b'], [ns]))[0]",
    "(lambda table: table['*b'])(ns.parent)",
    "ns['*b']",
]
FROM_THE_BLOCK = [
    "",
    ".tagName",
    ".ownerDocument",
    ".ownerDocument.implementation.createDOMBuilder(1, None)",
    ".parentNode.childNodes",
    ".attributes",
]
OTHER_WAYS = [
    "python.type(1)",
    "python.type('C', (dict,), dict(a=1))",
    "python.vars(ns)",
    "ns.root",
    "ns.root['python']",
    "ns.top()",
    "ns.depth",
    "ns.unevaluated",
    "ns.recursive.append(1)",
    "ns.parent.root",
    "ns",
    "[ns]",
    "str(ns)",
    "math",
    "python.repr(python)",
    "().__class__",
    "''.__class__.__mro__",
    "(lambda: 1).__globals__",
    "len.__self__",
    "dict.get.__self__",
    "python.map.__init__",
    "(x for x in [1]).gi_frame",
    "(x for x in [1]).gi_frame.f_back.f_builtins",
    "[x.gi_frame for x in [(y for y in [1])]]",
    "'{0.__class__}'.format(1)",
    "'{0.__class__}'.format_map(dict(a=1))",
    "str.format('{0.__class__}', 1)",
    "f'{().__class__",
    "(x := 1)",
    "[y := 1, y]",
    "load_yaml.func_globals",
    "xacro.load_yaml.__wrapped__",
    "xacro.warning.__closure__",
    "xacro.message('a', file=1).__class__",
    "open('PATH', 'w')",
    "eval('1')",
    "__import__('os')",
    "__builtins__",
    "python.__dict__",
    "str.join.__objclass__",
    "b'bytes'",
    "1 @ 2",
    "...",
    "await x",
    "(lambda *a: a.__class__)(1)",
    "python.sorted([1], key=lambda x: x.__class__)",
    "python.filter(lambda x: x.__class__, [1])",
    "list.__subclasses__()",
    "[].append(1)",
    "(1).to_bytes(1, 'big')",
    "'abc'.encode()",
    "len.call",
    "xacro.load_yaml.budget.refuse('x')",
    "python.map(lambda f: f.call, [len])",
    "[].copy.bound",
    "{}.get.__self__.__class__",
    "python.slice(1).stop",
    "[math]",
    "map(lambda m: m.pi, [math])",
    "dict(**math)",
    "f'{().__class__}'",
]


@pytest.fixture
def inside_a_macro(write):
    """Return a function that writes a file whose expression stands in a macro with a block parameter."""

    def inside_a_macro(expression: str):
        write(NAMESPACE, "ns.xacro")
        return write(
            '<xacro:macro name="m" params="*b"><xacro:include filename="ns.xacro" ns="ns"/>'
            f"<link name={quoteattr(expression)}/></xacro:macro><xacro:m><block/></xacro:m>"
        )

    return inside_a_macro


@pytest.mark.parametrize("expression", [a + b for a, b in product(TO_THE_BLOCK, FROM_THE_BLOCK)])
def test_no_expression_reaches_an_element_of_the_document(inside_a_macro, expression):
    with pytest.raises(ModelFileError):
        load_model(inside_a_macro(f"${{{expression}}}"))


@pytest.mark.parametrize("expression", OTHER_WAYS)
def test_no_expression_reaches_python(inside_a_macro, tmp_path, expression):
    target = tmp_path / "written"
    with pytest.raises(ModelFileError):
        load_model(inside_a_macro(f"${{{expression.replace('PATH', str(target))}}}"))
    assert not target.exists()


@pytest.mark.parametrize("expression", [way for way in OTHER_WAYS if not way.startswith("ns")])
def test_no_eval_expression_reaches_python(write, tmp_path, expression):
    target = tmp_path / "written"
    text = quoteattr(expression.replace("PATH", str(target)))
    inside = f'<xacro:property name="text" value={text}/><link name="$(eval ${{text}})"/>'
    with pytest.raises(ModelFileError):
        load_model(write(inside))
    assert not target.exists()


@pytest.mark.parametrize("expression", ["().__class__", "python.type", "math.update", "open"])
def test_a_unit_in_a_yaml_file_is_an_expression_too(write, tmp_path, expression):
    (tmp_path / "y.yaml").write_text(f'angle: !degrees "{expression}"')
    with pytest.raises(ModelFileError):
        load_model(write("<link name=\"${xacro.load_yaml('y.yaml')}\"/>"))


def test_a_text_file_is_no_yaml_file(write, tmp_path):
    (tmp_path / "secret.txt").write_text("hunter2\n")
    with pytest.raises(ModelFileError, match="neither a mapping nor a list") as caught:
        load_model(write("<link name=\"${xacro.load_yaml('secret.txt')}\"/>"))
    assert "hunter2" not in str(caught.value)


KEPT = {
    "ns.inside + ns.math.floor(2.5)": "3",
    "[k for k in dict(a=1, b=2).keys()]": "['a', 'b']",
    "'a-b'.split('-')[1].upper()": "B",
    "max([1, 2, 3], key=lambda x: -x)": "1",
    "python.sorted([3, 1, 2], reverse=True)": "[3, 2, 1]",
    "'%s_%03d' % ('link', 7)": "link_007",
    "'x' if 2 in range(3) and not False else 'y'": "x",
    "python.sum([i * i for i in range(4) if i % 2])": "10",
    "python.dict(zip=1)['zip']": "1",
    "python.isinstance('a', str)": "True",
    "python.list(python.enumerate(['a']))": "[(0, 'a')]",
    "round(math.degrees(pi), 2)": "180.0",
    "xacro.tokenize('a,b c')": "['a', 'b', 'c']",
    "xacro.dotify(dict(a=dict(b=4))).a['b']": "4",
    "'a' 'b' + '!'.join(['1', '2'])": "ab1!2",
    "(lambda a, b: a ** b)(2, 10)": "1024",
    "python.reversed([1, 2])[0] | 1 << 2": "6",
    "'%(n)03d of IRB-2400' % dict(n=7)": "007 of IRB-2400",
    "max(*[1, 2], **dict(key=lambda x: -x))": "1",
    "python.isinstance(1, (str, (int, float)))": "True",
    "[f() for f in [lambda: x for x in range(3)]]": "[2, 2, 2]",
    "(lambda x: [x for x in [9]] + [x])(1)": "[9, 1]",
    "python.sum([[1], [2]], [])": "[1, 2]",
}


@pytest.mark.parametrize(("expression", "value"), KEPT.items())
def test_what_xacro_documents_is_still_computed(inside_a_macro, expression, value):
    assert load_model(inside_a_macro(f"${{{expression}}}")).links[0].name == value
