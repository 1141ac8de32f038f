"""Drawing faults: one small change of a module's syntax tree, the same for the same seed."""

from __future__ import annotations

import ast
import copy
import random
from collections.abc import Iterator

from planting import Fault, source_of

FILES = (
    "frobs_sim_mujoco.robot",
    "frobs_sim_mujoco.simulation",
    "frobs_sim_mujoco.parameters",
    "frobs_sim_mujoco.body",
    "frobs_controllers.joint_delta_position",
    "frobs_controllers.joint_position",
    "frobs_controllers.joint_velocity",
    "frobs_controllers.joint_effort",
    "frobs_controllers.differential_drive",
    "frobs_controllers.tcp_delta_position",
    "frobs_tasks_reach.reach",
    "frobs_tasks_reach.goal",
    "frobs_tasks_reach.start",
    "frobs_tasks_reach.motion",
    "frobs_core.sensing.observation",
)
"""Where faults are drawn, turn by turn."""

_OPERATORS: dict[type, type] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.Lt: ast.LtE,
    ast.LtE: ast.Gt,
    ast.Gt: ast.GtE,
    ast.GtE: ast.Lt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
    ast.Is: ast.IsNot,
    ast.IsNot: ast.Is,
    ast.And: ast.Or,
    ast.Or: ast.And,
    ast.BitOr: ast.BitAnd,
    ast.BitAnd: ast.BitOr,
}
_FUNCTIONS = {"minimum": "maximum", "maximum": "minimum", "sin": "cos", "cos": "sin", "any": "all", "all": "any",
              "add": "subtract", "subtract": "add", "min": "max", "max": "min"}  # fmt: skip


def draw(count: int, seed: int) -> Iterator[Fault]:
    """Yield ``count`` faults, from each file in turn, none twice."""
    rng = random.Random(seed)
    places = {module: list(_places(ast.parse(source_of(module)))) for module in FILES}
    for module in FILES:
        rng.shuffle(places[module])
    for i in range(count):
        module = FILES[i % len(FILES)]
        if places[module]:
            yield mutate(module, *places[module].pop())


def mutate(module: str, number: int, kind: str) -> Fault:
    """Return a module with one node changed.

    Args:
        module: Its name.
        number: Of the node, in the order of ``ast.walk``.
        kind: What is done to it.
    """
    tree = ast.parse(source_of(module))
    node = list(ast.walk(tree))[number]
    before = ast.unparse(node)
    _change(node, kind, tree)
    after = "nothing" if kind == "drop" else ast.unparse(node)
    line = getattr(node, "lineno", 0)
    where = f"line {line}: `{' '.join(before.split())[:90]}` → `{' '.join(after.split())[:90]}`"
    return Fault(f"{kind} {number}", module, ast.unparse(ast.fix_missing_locations(tree)), where)


def _places(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Yield the nodes that can be changed, and how; only what runs: no signatures, annotations, docstrings, messages."""
    quiet = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef) and node.name == "describe":
            skipped = [node]  # what the documentation shows of a task; nothing runs by it
        elif isinstance(node, ast.FunctionDef):
            skipped = [node.args, node.returns, *node.decorator_list]
        elif isinstance(node, ast.AnnAssign):
            skipped = [node.annotation]
        elif isinstance(node, ast.Raise | ast.JoinedStr | ast.Import | ast.ImportFrom) or (
            isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"
        ):
            skipped = [node]
        else:
            skipped = []
        quiet |= {inner for part in skipped if part is not None for inner in ast.walk(part)}
    inside = {inner for f in ast.walk(tree) if isinstance(f, ast.FunctionDef) for inner in ast.walk(f)}
    for number, node in enumerate(ast.walk(tree)):
        if node not in quiet and node in inside:
            yield from ((number, kind) for kind in _kinds(node))


def _kinds(node: ast.AST) -> Iterator[str]:
    if isinstance(node, ast.BinOp | ast.BoolOp) and type(node.op) in _OPERATORS:
        yield "operator"
    elif isinstance(node, ast.Compare) and type(node.ops[0]) in _OPERATORS:
        yield "comparison"
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not | ast.USub):
        yield "sign"
    elif isinstance(node, ast.Constant) and type(node.value) in (int, float, bool):
        yield "constant"
    elif isinstance(node, ast.Attribute) and node.attr in _FUNCTIONS:
        yield "function"
    elif isinstance(node, ast.IfExp):
        yield "branch"
    elif (isinstance(node, ast.Expr) and isinstance(node.value, ast.Call)) or (
        isinstance(node, ast.Assign | ast.AugAssign) and isinstance(_target(node), ast.Subscript)
    ):
        yield "drop"


def _target(node: ast.Assign | ast.AugAssign) -> ast.expr:
    return node.target if isinstance(node, ast.AugAssign) else node.targets[0]


def _change(node: ast.AST, kind: str, tree: ast.Module) -> None:
    if kind == "operator":
        assert isinstance(node, ast.BinOp | ast.BoolOp)
        node.op = _OPERATORS[type(node.op)]()
    elif kind == "comparison":
        assert isinstance(node, ast.Compare)
        node.ops[0] = _OPERATORS[type(node.ops[0])]()
    elif kind == "sign":
        assert isinstance(node, ast.UnaryOp)
        node.op = ast.UAdd() if isinstance(node.op, ast.USub) else node.op
        if isinstance(node.op, ast.Not):
            node.operand = ast.UnaryOp(ast.Not(), copy.copy(node.operand))
    elif kind == "constant":
        assert isinstance(node, ast.Constant)
        assert isinstance(node.value, int | float)
        node.value = not node.value if isinstance(node.value, bool) else node.value + 1
    elif kind == "function":
        assert isinstance(node, ast.Attribute)
        node.attr = _FUNCTIONS[node.attr]
    elif kind == "branch":
        assert isinstance(node, ast.IfExp)
        node.body, node.orelse = node.orelse, node.body
    else:
        for parent in ast.walk(tree):
            for body in (getattr(parent, name, None) for name in ("body", "orelse", "finalbody")):
                if isinstance(body, list) and node in body:
                    body[body.index(node)] = ast.Pass()  # type: ignore[arg-type]
