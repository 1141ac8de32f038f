"""Hostile values that mutations and command lines use: numbers, names, expressions and data."""

from __future__ import annotations

CANARY = "FUZZ_EXECUTED"
"""Name of a file that only executed code would make."""

NUMBERS = (
    "nan", "inf", "-inf", "1e999", "-1e999", "1e308", "-1e308", "1e-320", "1_0", "-0", "0", "", " ", "1e", "0x10", "1,5",
    "１", "٣", "²", "½", "١٢", "1 2", "+-1", "--1", "true", "None", "9" * 400, "9" * 5000, "0." + "0" * 5000 + "1", "-1",
    "1000000000", "4294967296", "9223372036854775808", "1e9", "1e15", "0.5", "1", "2", "1\u00a0", "1\u2003", "1e3", "1E3",
    "${10**18}", "${1e308*10}", "$(eval 1/0)", "pi", "1;2", "1\n2",
)  # fmt: skip
NAMES = (
    "", " ", ".", "..", "/", "../outside/secret.txt", "../../../../etc/passwd", "/etc/passwd", "/dev/zero", "/dev/stdin",
    "/proc/self/mem", "~/x", "a/b", "a\\b", "C:\\x", "file:///etc/passwd", "file://%2e%2e/x", "package://a/b.stl",
    "package://../x.stl", "package://%00/x", "model://x", "http://127.0.0.1:9/x.stl", "world", "base", "base_link", "ground",
    "\x1b[31mred\x1b[0m", "\x1b]0;title\x07", "\x9b31m", "\x85", "a\nerror: b", "a\rb", "\x00", "\x7f", "\u202egnp.exe",
    "\u2028", "\ud7ff", "e\u0301", "é", "名前", "🤖", "a b", "a:b", "a=b", "a*b", "[red]x[/red]", "[/]", "{x}", "{0.__class__}",
    "%s%n", "%(a)s", "$(env HOME)", "${__import__('os').system('touch FUZZ_EXECUTED')}", "$(eval open('FUZZ_EXECUTED', 'w'))",
    "`touch FUZZ_EXECUTED`", "$(touch FUZZ_EXECUTED)", "; touch FUZZ_EXECUTED", "| touch FUZZ_EXECUTED", "-", "--help", "-rf",
    "x" * 300, "x" * 100_000, "é" * 200, "../" * 2000, "NaN", "null", "true", "1", "None", "__proto__", "__class__", "nul",
    "frobs/Nope-v0", "CartPole-v1", "mujoco", "irb120", "joint_position", "ppo",
)  # fmt: skip
IMPORTS = ("os:system", "fuzz_canary:Wrapper", "frobs_devkit.testing:CartPole-v1", "gymnasium.wrappers:RecordVideo")
"""Names of modules that only a trusted file may import."""

RAW = (
    '"1"', "null", "true", "false", "0", "-1", "1.5", "1e999", "-1e999", "NaN", "Infinity", "[]", "{}", '""', '"x"', "[1, 2]",
    '{"a": 1}', "[[], {}]", "1" + "0" * 30, "1" + "0" * 5000, "1" * 200_000, "[" * 100_000, "[" * 50_000 + "]" * 50_000,
    '{"a":' * 20_000 + "1" + "}" * 20_000, "[" + "1," * 300_000 + "1]", '"' + "x" * 300_000 + '"', "1e-320", "4294967296",
    "1000000000", "10000", '"\\u001b[31mred\\u001b[0m\\u0007"', '"a\\nerror: b"', '"\\ud800"', '"\\u0000"', '"\\u009b31m"',
    '"../outside/secret.txt"', '"/dev/zero"', '"/etc/passwd"', "[null]", '[{"name": 5}]', "[1e308, -1e308]", "0.0", "1e-9",
    "true1", "{", "}", "[1, ]", '{"a": 1, "a": 2}', '{"": 1}', "2.0", "3", "64", '"float64"', '"Box"', '"nan"', "[[1], [1, 2]]",
)  # fmt: skip
"""JSON texts that replace a value. Not all are valid JSON."""

YAML = (
    "1:1:1:1", "1:1" * 20_000, "190:20:30", "!!python/object/apply:os.system [touch FUZZ_EXECUTED]",
    "!!python/name:os.system", "!!python/object/new:type [x, [], {}]", "!!binary aGVsbG8=", "!!set {a, b}", "!!int '1' ", "*a",
    "&a [*a]", "&a {<<: *a}", "!x 1", "@x", "`x", "%x", "yes", "on", "0o17", "0b1", "0x_", "1_000", "2001-01-01", "2001-13-45",
    "99999-01-01", "~", ".nan", ".inf", "-.inf", "? [1]\n  : 2", "|\n  x", ">-\n  x", "{? {a: 1}: 2}", "'", '"', "- - - 1",
    "&a " * 1000 + "1", "{a: &b [1, 2], c: *b}", "[" + "&a x, " * 5000 + "]",
)  # fmt: skip
"""YAML texts that replace a value, besides those of :data:`RAW`."""

XML = (
    "<!-- " + "x" * 200_000 + " -->", "<!-- " + "<unit " * 50_000 + "-->", "\n" * 200_000, " " * 1_000_000, "<a>" * 20_000,
    "<a>" * 5_000 + "</a>" * 5_000, "<![CDATA[" + "x" * 1000 + "]]>", "<?x y?>", "&lt;", "&#27;", "&#0;", "&e;", "&#x1F916;",
    "<a " + " ".join(f'b{i}="1"' for i in range(20_000)) + "/>", "<a/>" * 100_000, "<n:a/>", '<a xmlns="b"/>', "\x00", "\x1b",
    "<link/>", '<link name="extra"/>', '<joint name="j"/>', '<include file="SELF"/>', '<include file="."/>',
    '<include filename="SELF"/>', '<xacro:include filename="SELF"/>', '<xacro:include filename="/etc/passwd"/>',
    '<xacro:include filename="*"/>', "<xacro:insert_block name='b'/>", '<xacro:property name="p" value="${p}"/>',
    '<xacro:macro name="m"><xacro:m/></xacro:macro><xacro:m/>', '<xacro:call macro="m"/>', "<xacro:if/>", "<xacro:m/>",
    '<xacro:property name="y" value="${xacro.load_yaml(\'/etc/passwd\')}"/>', '<xacro:element xacro:name="${1}"/>',
    '<xacro:attribute name="a" value="${1}"/>', '<xacro:arg name="a" default="$(arg a)"/>', '<default class="d"/>',
    '<compiler meshdir="/" angle="x"/>', "<option timestep='1e-9'/>", '<replicate count="1000000"><geom size="1"/></replicate>',
    '<asset><mesh name="x" file="/etc/passwd"/></asset>', '<plugin filename="/tmp/x.so"/>', '<gazebo reference="nope"/>',
    '<transmission name="t"/>', '<mimic joint="self"/>', "<inertial/>", "<extension><plugin plugin='mujoco.x'/></extension>",
    '<asset><texture name="t" builtin="flat" width="20000" height="20000"/></asset>', "<material/>", '<material name="m"/>',
)  # fmt: skip
"""Texts that are inserted into an XML document. ``SELF`` becomes the name of the document's file."""

TOKENS = (
    *NUMBERS[:32], "usemtl", "usemtl" + " " * 100_000, "v", "f", "f 1 2 3", "f 1/1/1 2//2 3/3", "f -1 -2 -3", "f 0 0 0",
    "mtllib ../outside/secret.txt", "mtllib /dev/zero", "endsolid", "facet", "vertex 1 2 3", "element vertex 1000000000",
    "property list uchar int x", "end_header", "format binary_big_endian 1.0", "OFF 1000000000 1 1", "#" * 100_000, "\n" * 100_000,
    "g " * 10_000, "\\\n" * 1000, "\x00" * 10, "\x1b[31m", "é", "o x\n" * 5000, "v 0 0 0\n" * 20_000, "=", ",", '"',
)  # fmt: skip
"""Words that replace a word of a text file, such as an OBJ or CSV file."""
