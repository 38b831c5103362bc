"""C++ as a sequence of tokens: sufficient to find operators, constants and statements."""

import bisect
import re
from dataclasses import dataclass

_TOKEN = re.compile(
    r"""(?P<skip>//[^\n]*|/\*.*?\*/)
      | (?P<text>(?:u8|[uUL])?R"(?P<mark>[^()\\\s]*)\(.*?\)(?P=mark)"|(?:u8|[uUL])?"(?:\\.|[^"\\\n])*"
                |(?:u8|[uUL])?'(?:\\.|[^'\\\n])+')
      | (?P<number>\.?\d(?:'?[\w.]|(?<=[eEpP])[+-])*)
      | (?P<name>[A-Za-z_]\w*)
      | (?P<sign><=>|<<=|>>=|\.\.\.|->\*|::|->|\+\+|--|<<|<=|>=|==|!=|&&|\|\||[-+*/%&|^]=|[^\s\w])""",
    re.S | re.X)
_DIRECTIVE = re.compile(r"[ \t]*#(?:[^\n\\]|\\.)*", re.S)
_OPEN, _CLOSE = {"(": ")", "[": "]", "{": "}"}, {")", "]", "}"}


@dataclass
class Token:
    kind: str  # name, number, text, sign
    text: str
    start: int
    end: int
    line: int
    spaced: bool  # white space on both sides: the formatter's style for a binary operator
    match: int = -1  # the matching bracket
    inside: int = -1  # the innermost open bracket


def tokens_of(source):
    """All tokens but comments and preprocessor lines, with brackets matched."""
    lines = [m.end() for m in re.finditer("\n", source)]
    found, at, fresh = [], 0, True
    while at < len(source):
        if fresh and (directive := _DIRECTIVE.match(source, at)):
            at = directive.end()
            continue
        if source[at].isspace():
            fresh = fresh or source[at] == "\n"
            at += 1
            continue
        token = _TOKEN.match(source, at)
        if token is None:
            raise ValueError(f"not understood: {source[at:at + 20]!r}")
        fresh = False
        start, at = at, token.end()
        if token.lastgroup == "skip" or token.group("skip"):
            continue
        kind = next(k for k in ("text", "number", "name", "sign") if token.group(k) is not None)
        spaced = source[start - 1:start].isspace() and source[at:at + 1].isspace()
        found.append(Token(kind, token.group(), start, at, bisect.bisect_right(lines, start) + 1, spaced))
    _match_brackets(found)
    return found


def _match_brackets(tokens):
    opened = []
    for i, token in enumerate(tokens):
        if token.kind == "sign" and token.text in _CLOSE and opened:
            other = opened.pop()
            token.match, tokens[other].match = other, i
        token.inside = opened[-1] if opened else -1
        if token.kind == "sign" and token.text in _OPEN:
            opened.append(i)
