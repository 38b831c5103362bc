"""Positions of small faults in a C++ file, and a rewritten file that contains all of them."""

import os
import re
from dataclasses import dataclass, field

from tokens import tokens_of

_RELATIONS = {"<": ("less", "<=", ">="), "<=": ("at_most", "<", ">"), ">": ("more", ">=", "<="),
              ">=": ("at_least", ">", "<")}
_EQUALITIES = {"==": ("equal", "!="), "!=": ("unequal", "==")}
_SUMS = {"+": ("plus", "-"), "-": ("minus", "+")}
_ASSIGNS = {"=", "+=", "-=", "*=", "/=", "%=", "&=", "|=", "^=", "<<=", ">>="}
_OPENING, _CLOSING = {"(", "[", "{"}, {")", "]", "}"}
_ENDS_OPERAND = {",", ";", "?", ":", "return", "co_return", "throw", "case", "else"} | _ASSIGNS
_INTEGER = re.compile(r"(0[xXbB][\dA-Fa-f']+|[\d']+)[uUlLzZ]*$")
_FRACTION = re.compile(r"[\d']*\.?[\d']*([eE][-+]?\d+)?[fFlL]?$")


@dataclass
class Fault:
    """One wrong operator or constant."""
    path: str
    line: int
    before: str
    after: str
    text: str  # the source line, which identifies a fault when lines have moved
    nth: int   # index among equal ones on that line, from 1
    number: int = 0

    def key(self):
        return (self.path, self.text, f"{self.before} -> {self.after}", self.nth)

    def __str__(self):
        nth = f" ({self.nth})" if self.nth > 1 else ""
        return f"{self.path}:{self.line}: {self.before} -> {self.after}{nth}    {self.text}"


@dataclass
class Edit:
    start: int
    end: int
    text: str
    rank: int  # of edits at one position: closing ones first, inner before outer
    line: int


@dataclass
class Site:
    faults: list
    line: int
    make: object  # fault numbers -> list of Edits


@dataclass
class Sites:
    path: str
    source: str
    enums: dict
    sites: list = field(default_factory=list)
    constants: list = field(default_factory=list)  # Edits that remove constexpr
    seen: dict = field(default_factory=dict)

    def __post_init__(self):
        self.tokens = tokens_of(self.source)
        self.lines = self.source.split("\n")
        self.fixed = self._fixed()
        self.settled = self._constants()
        for i, token in enumerate(self.tokens):
            if i in self.fixed:
                continue
            if token.kind == "sign":
                self._sign(i)
            elif token.kind == "number":
                self._number(i)
            elif token.kind == "name":
                self._name(i)
            self._statement(i)

    # ---- exclusions --------------------------------------------------------------------------------

    def _fixed(self):
        """Static assertions, case labels, template heads, enumerations, attributes."""
        t, fixed = self.tokens, set()
        for i, token in enumerate(t):
            if token.text in ("static_assert", "alignas", "decltype", "noexcept", "explicit"):
                if i + 1 < len(t) and t[i + 1].text == "(":
                    fixed.update(range(i, t[i + 1].match + 1))
            elif token.text == "case":
                j = i
                while t[j].text != ":":
                    j += 1
                fixed.update(range(i, j + 1))
            elif token.text == "enum":
                j = i
                while t[j].text not in ("{", ";"):
                    j += 1
                fixed.update(range(i, (t[j].match if t[j].text == "{" else j) + 1))
            elif token.text == "[" and t[i + 1].text == "[":
                fixed.update(range(i, token.match + 1))
            elif token.text in ("template", "requires", "concept", "using", "operator"):
                j = i + 1
                while t[j].line == token.line and t[j].text not in (";", "{"):
                    j += 1
                fixed.update(range(i, j))
        return fixed

    def _scope(self, i):
        """Kind of the innermost brace around a token: namespace, class, or a function's body."""
        t = self.tokens
        while (i := t[i].inside) >= 0:
            if t[i].text != "{":
                continue
            j = i - 1
            while j >= 0 and t[j].text not in (";", "{", "}", ")"):
                if t[j].text in ("namespace", "class", "struct", "union"):
                    return "namespace" if t[j].text == "namespace" else "class"
                j -= 1
            return "body"
        return "namespace"

    def _constants(self):
        """The initialisers of constants; outside of classes their `constexpr` becomes `const`."""
        t, settled = self.tokens, set()
        for i, token in enumerate(t):
            if token.text not in ("constexpr", "const") or (i and t[i - 1].text in (")", "if", ",", "(", "*", "&")):
                continue
            if i and t[i - 1].kind == "name" and t[i - 1].text not in ("inline", "static", "else"):
                continue
            j = i + 1
            while j < len(t) and t[j].text not in ("=", "{", "(", ";", ")", ","):
                j += 1
            if j == len(t) or t[j].text not in ("=", "{") or (t[i].inside >= 0 and t[t[i].inside].text != "{"):
                continue
            end = j
            while t[end].text != ";":
                end = t[end].match + 1 if t[end].text in _OPENING else end + 1
                if end >= len(t):
                    break
            if end >= len(t) or "(" in (x.text for x in t[i:j]):
                continue
            if self._scope(i) == "class":
                if token.text == "constexpr":
                    self.fixed.update(range(i, end))
                continue
            if token.text == "constexpr":
                numbers = [k for k in range(j, end) if t[k].kind == "number"]
                named = any(t[k].kind == "name" for k in range(j, end))
                # Strings alone cannot be wrong; `constexpr const char*` is const already.
                words = any(t[k].kind == "text" for k in range(j, end))
                if not numbers and not named or words and any(x.text == "const" for x in t[i + 1:j]):
                    continue
                self.constants.append(Edit(token.start, token.end, "const", 0, token.line))
            settled.update(range(j, end))
        return settled

    # ---- the faults --------------------------------------------------------------------------------

    def _add(self, i, pairs, make):
        line = self.tokens[i].line
        text = " ".join(self.lines[line - 1].split())
        faults = []
        for pair in pairs:
            self.seen[line, pair] = self.seen.get((line, pair), 0) + 1
            faults.append(Fault(self.path, line, *pair, text, self.seen[line, pair]))
        self.sites.append(Site(faults, line, make))

    def _replace(self, i, pairs, words):
        token = self.tokens[i]
        self._add(i, pairs, lambda n: [Edit(token.start, token.end, words(n), 0, token.line)])

    def _wrap(self, i, pairs, first, last, opening, closing):
        """Wraps the tokens first to last."""
        a, b = self.tokens[first], self.tokens[last]
        length = b.end - a.start
        self._add(i, pairs, lambda n: [Edit(a.start, a.start, opening(n), -length, a.line),
                                       Edit(b.end, b.end, closing, length - (1 << 30), b.line)])

    def _sign(self, i):
        token = self.tokens[i]
        sign = token.text
        if sign == "!":
            if (last := self._operand_end(i + 1)) is not None:
                self._wrap(i, [("!", "")], i, last, lambda n: f"(::faults::on({n[0]}) != ", ")")
        elif sign == "-" and not token.spaced and self._starts_operand(i):
            if self.tokens[i + 1].start == token.end and (last := self._operand_end(i + 1)) is not None:
                a = self.tokens[i]
                b = self.tokens[last]
                length = b.end - a.start
                self._add(i, [("-", "")], lambda n: [
                    Edit(a.start, a.end, f"::faults::unsign({n[0]}, ", -length, a.line),
                    Edit(b.end, b.end, ")", length - (1 << 30), b.line)])
        elif not token.spaced:
            return
        elif sign in _RELATIONS:
            name, shifted, turned = _RELATIONS[sign]
            self._replace(i, [(sign, shifted), (sign, turned)],
                          lambda n: f"{sign} ::faults::{name}({n[0]}, {n[1]}) {sign}")
        elif sign in _EQUALITIES or (sign in _SUMS and not self._starts_operand(i)):
            name, turned = (_EQUALITIES.get(sign) or _SUMS.get(sign))
            self._replace(i, [(sign, turned)], lambda n: f"{sign} ::faults::{name}({n[0]}) {sign}")
        elif sign in ("&&", "||"):
            self._logic(i)

    def _starts_operand(self, i):
        """True if the token at i begins an operand."""
        before = self.tokens[i - 1]
        if before.kind in ("number", "text") or before.text in (")", "]", "}"):
            return False
        return before.kind == "sign" or before.text in ("return", "case", "co_return", "throw")

    def _operand_end(self, i):
        """The last token of the postfix expression that begins at i."""
        t = self.tokens
        while t[i].text in ("!", "*", "-", "&"):
            i += 1
        if t[i].text == "::":
            i += 1
        if t[i].text == "(":
            last = t[i].match
        elif t[i].kind in ("name", "number"):
            last = i
        else:
            return None
        while last + 1 < len(t):
            following = t[last + 1]
            if following.text in ("(", "[") or (following.text == "{" and following.start == t[last].end):
                last = following.match
            elif following.text in ("::", ".", "->"):
                last += 2
            else:
                break
        return last

    def _logic(self, i):
        t, sign = self.tokens, self.tokens[i].text
        stops = _ENDS_OPERAND | ({"||"} if sign == "&&" else set())
        first = i - 1
        while True:
            if t[first].text in _CLOSING:
                first = t[first].match
            before = t[first - 1]
            if first == 0 or before.text in stops or before.text in _OPENING:
                break
            if before.text == "}" and t[first].line != before.line:
                break
            first -= 1
        last, stops = i + 1, _ENDS_OPERAND | {"||"} | ({"&&"} if sign == "&&" else set())
        while True:
            if t[last].text in _OPENING:
                last = t[last].match
            if last + 1 == len(t) or t[last + 1].text in stops or t[last + 1].text in _CLOSING:
                break
            last += 1
        a, b, c, d, token = t[first], t[i - 1], t[i + 1], t[last], t[i]
        whole, left, right = d.end - a.start, b.end - a.start, d.end - c.start
        down = 1 << 30
        other = "||" if sign == "&&" else "&&"
        # a || b is !(!a && !b): neither operand occurs twice, and skipped operands stay skipped.
        self._add(i, [(sign, other)], lambda n: [
            Edit(a.start, a.start, "(((((bool)(", -whole, a.line),
            Edit(b.end, b.end, f")) != ::faults::on({n[0]}))", left - down, b.line),
            Edit(c.start, c.start, "(((bool)(", -right, c.line),
            Edit(d.end, d.end, f")) != ::faults::on({n[0]}))) != ::faults::on({n[0]}))", whole - down,
                 d.line)])

    def _number(self, i):
        text = self.tokens[i].text
        function = "constant" if i in self.settled else "number"
        if _INTEGER.match(text):
            digits = text.replace("'", "").rstrip("uUlLzZ")
            after = str(int(digits, 0 if digits[:2].lower() in ("0x", "0b") else 10) + 1)
        elif _FRACTION.match(text) and text[:2].lower() != "0x":
            value = float(text.rstrip("fFlL").replace("'", ""))
            after = f"{2 * value if value else 1.0:g}"
        else:
            return
        if i and self.tokens[i - 1].text == "<" and not self.tokens[i - 1].spaced:
            return  # a template argument
        if i + 1 < len(self.tokens) and self.tokens[i + 1].text == ">" and not self.tokens[i + 1].spaced:
            return
        self._replace(i, [(text, after)], lambda n: f"::faults::{function}({n[0]}, {text})")

    def _chosen(self, i):
        return "::faults::met" if i in self.settled else "::faults::on"

    def _name(self, i):
        t, text = self.tokens, self.tokens[i].text
        if text in ("true", "false"):
            after = "false" if text == "true" else "true"
            chosen = self._chosen(i)
            self._replace(i, [(text, after)], lambda n: f"({chosen}({n[0]}) != {text})")
        elif text in ("if", "while") and t[i + 1].text == "(":
            self._condition(i, i + 1)
        elif re.match(r"k[A-Z]", text) and i >= 2 and t[i - 1].text == "::":
            self._enumerator(i)

    def _condition(self, i, bracket):
        t = self.tokens
        inner = [k for k in range(bracket + 1, t[bracket].match) if t[k].inside == bracket]
        signs = [t[k].text for k in inner if t[k].kind == "sign"]
        if not inner or ";" in signs or any(s in _ASSIGNS for s in signs):
            return
        logic = any(s in ("&&", "||") for s in signs)
        compared = any(t[k].spaced and (t[k].text in _RELATIONS or t[k].text in _EQUALITIES) for k in inner)
        if not logic and (compared or signs[:1] == ["!"] and t[inner[0]].text == "!"):
            return  # the operator itself is negated
        self._wrap(i, [(f"{t[i].text} (...)", f"{t[i].text} (!(...))")], bracket + 1, t[bracket].match - 1,
                   lambda n: f"::faults::on({n[0]}) != (bool)(", ")")

    def _enumerator(self, i):
        t = self.tokens
        name, chosen, on = t[i - 2].text, t[i].text, self._chosen(i)
        stem = os.path.splitext(self.path)[0]
        known = sorted(self.enums.get(name, []), key=lambda e: os.path.splitext(e[0])[0] != stem)
        values = next((v for _, v in known if chosen in v), None)
        if not values or len(values) < 2 or (i + 1 < len(t) and t[i + 1].text in ("::", "(")):
            return
        other = values[(values.index(chosen) + 1) % len(values)]
        first = i - 2
        while t[first - 1].text == "::":
            first -= 2 if t[first - 2].kind == "name" else 1
        start, end = t[first].start, t[i].end
        scope = self.source[start:t[i].start]
        if t[first - 1].text == "<" and not t[first - 1].spaced:
            return
        self._add(i, [(f"{name}::{chosen}", f"{name}::{other}")], lambda n: [
            Edit(start, end, f"({on}({n[0]}) ? {scope}{other} : {scope}{chosen})", 0, t[first].line)])

    def _statement(self, i):
        """Assignments and increments that can be omitted."""
        t = self.tokens
        before = t[i - 1] if i else None
        if before is None or t[i].inside < 0 or t[t[i].inside].text != "{":
            return
        if before.text == ")":
            head = t[before.match - 1].text if before.match > 0 else ""
            if head not in ("if", "while", "for", "constexpr"):
                return
        elif before.text not in (";", "{", "}", "else", ":"):
            return
        j = i
        step = t[j].text in ("++", "--")
        while t[j].text in ("*", "++", "--"):
            j += 1
        if t[j].kind != "name" and t[j].text != "(":
            return
        last = self._operand_end(j)
        if last is None or last + 1 >= len(t):
            return
        end = last + 1
        if t[end].text in ("++", "--"):
            step, end = True, end + 1
        if step and t[end].text != ";":
            return
        if not step and t[end].text not in _ASSIGNS:
            return
        while t[end].text != ";":
            end = t[end].match + 1 if t[end].text in _OPENING else end + 1
            if end >= len(t) or t[end].text in _CLOSING:
                return
        words = " ".join(self.source[t[i].start:t[end].end].split())
        self._wrap(i, [(words, "(left out)")], i, end, lambda n: f"{{ if (!::faults::on({n[0]})) {{ ", " } }")


def enums_of(sources):
    """Name -> (path, its enumerators), of every enumeration in these (path, text)."""
    found = {}
    for path, source in sources:
        t = tokens_of(source)
        for i, token in enumerate(t):
            if token.text != "enum":
                continue
            j = i + 1
            while t[j].text not in ("{", ";"):
                j += 1
            if t[j].text == ";":
                continue
            names = [x for x in t[i + 1:j] if x.text not in ("class", "struct")]
            if not names or names[0].kind != "name":
                continue
            values = [t[k].text for k in range(j + 1, t[j].match)
                      if t[k].kind == "name" and t[k - 1].text in ("{", ",")]
            found.setdefault(names[0].text, []).append((path, values))
    return found


def rewritten(sites, dropped):
    """The file with all its faults, except on lines that do not compile."""
    edits = [e for e in sites.constants if e.line not in dropped]
    for site in sites.sites:
        made = site.make([fault.number for fault in site.faults])
        if not any(e.line in dropped for e in made):
            edits += made
    edits.sort(key=lambda e: (e.start, e.end > e.start, e.rank))
    text, at = [], 0
    # At one position: closings, openings from the outside in, then replacements.
    for edit in edits:
        text += [sites.source[at:edit.start], edit.text]
        at = max(at, edit.end)
    return "".join(text) + sites.source[at:]


def placed(sites, dropped):
    """The faults contained in such a copy."""
    return [fault for site in sites.sites
            if not any(e.line in dropped for e in site.make([f.number for f in site.faults]))
            for fault in site.faults]
