"""A small xacro file cannot take the memory or the time of the process."""

from __future__ import annotations

import pytest

from frobs_core.models import load_model
from frobs_core.util.errors import ModelFileError


def macro(name: str, body: str, params: str = "") -> str:
    return f'<xacro:macro name="{name}" params="{params}">{body}</xacro:macro>'


def prop(name: str, value: object) -> str:
    return f'<xacro:property name="{name}" value="{value}"/>'


def grown(start: str, step: str, count: int = 12) -> str:
    """Return properties of which each repeats the one before."""
    return prop("p0", start) + "".join(prop(f"p{i}", step.replace("P", f"p{i - 1}")) for i in range(1, count + 1))


EXPRESSIONS = [
    "10**10**10",
    "2**64",
    "(-3)**10**9",
    "1&lt;&lt;10**10",
    "9" * 4000,
    "'a'*10**12",
    "10**12*'a'",
    "[0]*10**9",
    "(0,)*10**9",
    "list(range(10**9))",
    "python.sum(range(10**9))",
    "[1 for a in range(999) for b in range(999) for c in range(999)]",
    "python.set([a + 1000 * b for a in range(999) for b in range(999)])",
    "'%1000000000d' % 1",
    "'%*d' % (10**9, 1)",
    "'%s' * 1000 % (('a' * 900000,) * 1000)",
    "('a'*900000).replace('a', 'b'*1000)",
    "('a'*900000).join(['b']*1000)",
    "'x'.zfill(10**10)",
    "'x'.ljust(10**10)",
    "'x'.center(10**10, 'y')",
    "math.factorial(10**8)",
    "math.comb(10**9, 10**8)",
    "math.perm(10**6)",
    "math.prod(range(1, 100))",
    "math.lcm(*range(1, 100))",
    "round(5, -10**9)",
    "int('1' * 999999, 16)",
    "(lambda f: f(f))(lambda f: f(f))",
    "(lambda f: f(f))(lambda f: [f(f), f(f)])",
    "python.sorted(range(99999), key=lambda x: -x)",
    "max([list(range(9999)) == list(range(9999)) for i in range(9999)])",
    "1" + "+1" * 2400,
    "-" * 4900 + "1",
    "1" + "+1" * 5000,
    "x." * 2000 + "y",
    "[" * 120 + "]" * 120,
    "'%(a)999999999d' % dict(a=1)",
    "'%((a))999999999d' % dict([('(a)', 1)])",
    "[0.5 in range(99999) for i in range(50000)]",
    "[math.fsum(range(99999)) for i in range(9999)]",
    "[" + "*range(99999), " * 300 + "]",
    "[math.hypot(*range(9999)) for i in range(9999)]",
    "python.sum([[1] * 999] * 99, [])",
    "[python.sum(range(99999)) for i in range(9999)]",
    "[max(range(99999), key=python.abs) for i in range(9999)]",
    "[python.filter([].count, range(99999)) for i in range(9999)]",
    "(lambda f: python.sorted([f], key=f))(lambda f: python.sorted([f], key=f))",
]
FILES = {
    "macros that call others ten times": macro("a0", "<x/>")
    + "".join(macro(f"a{i}", f"<xacro:a{i - 1}/>" * 10) for i in range(1, 12))
    + "<xacro:a11/>",
    "a macro that calls itself twice": macro(
        "m", '<xacro:if value="${n}"><xacro:m n="${n-1}"/><xacro:m n="${n-1}"/></xacro:if>', "n"
    )
    + '<xacro:m n="60"/>',
    "properties that repeat others": grown("ha", "${P}" * 10) + '<link name="${p12}"/>',
    "lists that repeat others": grown("ha", "${[P]*10}") + '<link name="${p12}"/>',
    "lists in lists": grown("ha", "${[P, P]}", 60) + '<link name="${p60}"/>',
    "a body that is copied and dropped": macro("m", '<xacro:if value="0">' + "<x/>" * 9000 + "</xacro:if>")
    + "<xacro:m/>" * 900,
    "comments that are copied": macro("m", '<xacro:if value="0">' + "<!---->" * 20_000 + "</xacro:if>")
    + "<xacro:m/>" * 900,
    "blocks that are inserted": macro("m", '<xacro:insert_block name="b"/>' * 1000, "*b")
    + macro("n", "<xacro:m><y>" + "<x/>" * 100 + "</y></xacro:m>")
    + "<xacro:n/>" * 100,
    "a file that includes itself": '<xacro:include filename="r.urdf.xacro"/>',
    "a large file, again and again": '<xacro:include filename="large.xacro"/>' * 100,
    "the files of the whole disk": '<xacro:include filename="/*/*/*/*"/>',
    "fifty thousand properties": prop("a", "1") * 50_000,
    "parameters that never match": macro("m", "", "a:=" + "b" * 60 + "'"),
    "as many parameters as there is room for": macro("m", "", " ".join(f"a{i}" for i in range(100_000))),
    "an attribute of three megabytes": '<link name="' + "x" * 3_000_000 + '"/>',
    "properties that copy a long text": prop("a", "x" * 900_000)
    + "".join(prop(f"p{i}", "${a}") + f'<a v="${{p{i}}}"/>' for i in range(2000)),
    "arguments that copy a long text": '<xacro:arg name="a" default="'
    + "x" * 900_000
    + '"/>'
    + '<a v="$(eval a)"/>' * 2000,
    "comparisons of methods": prop("a", "${list(range(9999))}")
    + prop("m", "${[a.count == a.count for i in range(9999)]}")
    + "".join(f'<a v="${{[m == m, {i}]}}"/>' for i in range(2000)),
    "sorting by long lists": prop("a", "${list(range(9999))}")
    + '<a v="${python.sorted(range(3000), key=lambda x: a)}"/>',
    "messages without end": "<a v=\"${xacro.warning('x')}\"/>" * 9000,
    "searching from the end": prop("s", "a" * 900_000)
    + prop("part", "ab" + "a" * 450_000)
    + '<a v="${s.rfind(part)}"/>',
    "splitting from the end": prop("s", "a" * 900_000)
    + prop("part", "ab" + "a" * 450_000)
    + '<a v="${s.rsplit(part)}"/>',
    "stripping many characters": prop("s", "a" * 900_000)
    + prop("part", "b" * 450_000 + "a")
    + '<a v="${s.strip(part)}"/>',
    "complex numbers with the same hash": prop("p", "${[k * 1j - 1000003.0 * k for k in range(12000)]}")
    + '<a v="${[len(python.set(p)) for i in range(20)]}"/>',
    "a method of a long list": prop("m", "${list(range(9999)).count}") + '<a v="${[m(-1) for i in range(30000)]}"/>',
    "mappings that are unpacked": prop("p", "${dict(python.zip(range(20000), range(20000)))}")
    + '<a v="${dict('
    + "**p, " * 900
    + ')}"/>',
    "the name of an argument": '<link name="$(arg ' + "a" * 900_000 + ')"/>',
}
YAML = {
    "aliases": "a0: &amp;a0 [1]\n"
    + "".join(f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]\n" for i in range(1, 12)).replace("&", "&"),
    "merged mappings": "a0: &a0 {x: 1, y: 2}\n"
    + "".join(f"a{i}: &a{i} {{<<: [{', '.join([f'*a{i - 1}'] * 90)}]}}\n" for i in range(1, 12)),
    "an alias of itself": "&a [*a]",
    "depth": "[" * 5000,
    "many values": "[" + "1," * 200_000 + "]",
    "integers with the same hash": "".join(f"{k * (2**61 - 1)}: 1\n" for k in range(6000)),
    "a large file": "# " + "x" * 10**6,
    "a Python object": "!!python/object/apply:os.mkdir [made]",
    "bytes": "a: !!binary aGVsbG8=",
}
YAML["aliases"] = YAML["aliases"].replace("&amp;", "&")


@pytest.mark.parametrize("expression", EXPRESSIONS, ids=lambda text: text[:40])
def test_an_expression_beyond_all_measure_is_refused(write, expression):
    with pytest.raises(ModelFileError):
        load_model(write(f'<link name="${{{expression}}}"/>'))


@pytest.mark.parametrize("inside", FILES.values(), ids=FILES.keys())
def test_a_file_that_grows_without_end_is_refused(write, inside):
    write("<a/>" * 4000, "large.xacro")
    with pytest.raises(ModelFileError):
        load_model(write(inside))


@pytest.mark.parametrize("text", YAML.values(), ids=YAML.keys())
def test_a_yaml_file_that_grows_without_end_is_refused(write, tmp_path, text):
    (tmp_path / "y.yaml").write_text(text)
    with pytest.raises(ModelFileError):
        load_model(write("<link name=\"${xacro.load_yaml('y.yaml')}\"/>"))


@pytest.mark.parametrize(
    ("inside", "limit"),
    [
        (FILES["macros that call others ten times"], "xacro steps; the limit is 300,000"),
        ("<a v=\"${'a' * 10**7}\"/>", "limit is 1,000,000"),
        ('<a v="${[0] * 10**7}"/>', "limit is 100,000"),
        ('<a v="${2**63}"/>', r"limit of 2\*\*63"),
        ('<a v="' + "${" + "1+" * 3000 + '1}"/>', "the limit is 5,000"),
    ],
)
def test_the_message_names_the_limit(write, inside, limit):
    with pytest.raises(ModelFileError, match=limit):
        load_model(write(inside))
