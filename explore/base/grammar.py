"""Recursive descent over the tokens of a text; a grammar, such as that of conditions, is a subclass."""

import re
from collections.abc import Callable
from typing import ClassVar, TypeVar

from explore.base.errors import RequestError

_Content = TypeVar("_Content")

NUMBER = r"(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?"
NAME = r"[^\W\d]\w*"
#: Largest depth of nested brackets; the descent recurses a few times for each.
MAX_DEPTH = 50


class Descent:
    """The tokens of a text, read one after the other; `_next` is the index of the next one.

    A subclass gives the pattern of its tokens, with a group for each kind, among them "name", "bracket" and "end", and
    the beginning of its messages.
    """

    _PATTERN: ClassVar[re.Pattern[str]]
    _SUBJECT: ClassVar[str] = ""

    def __init__(self, text: str) -> None:
        self._text = text
        self._tokens, self._next, self._depth = self._tokenize(), 0, 0

    def _explain_unknown(self, rest: str) -> str:
        """Why `rest` does not begin with a token, and what to write instead."""
        raise NotImplementedError

    def _explain_extra(self) -> str:
        """Why the next token cannot follow what is complete."""
        raise NotImplementedError

    def _tokenize(self) -> list[tuple[str, str, int]]:
        """The tokens as (kind, text, position)."""
        tokens: list[tuple[str, str, int]] = []
        position = 0
        while not tokens or tokens[-1][0] != "end":
            match = self._PATTERN.match(self._text, position)
            if match is None:
                position += len(self._text[position:]) - len(self._text[position:].lstrip())
                raise self._error(self._explain_unknown(self._text[position:]), position)
            kind = str(match.lastgroup)
            tokens.append((kind, match[kind], match.start(kind)))
            position = match.end()
        return tokens

    def _error(self, reason: str, position: int | None = None) -> RequestError:
        """The error that a reason at a position, by default that of the next token, is."""
        position = self._tokens[self._next][2] if position is None else position
        where = f"character {position + 1}" if position < len(self._text.rstrip()) else "the end"
        return RequestError(f"{self._SUBJECT}at {where}: {reason}")

    def _take(self, *words: str) -> str:
        """Consume the next token if it is one of these words, signs or brackets; return it, or nothing."""
        kind, word, _ = self._tokens[self._next]
        if kind in ("number", "end") or word not in words:
            return ""
        self._next += 1
        return word

    def _in_brackets(self, read: Callable[[], _Content]) -> _Content:
        """What `read` reads up to the closing bracket, after an opening one was taken."""
        self._depth += 1
        if self._depth > MAX_DEPTH:
            raise self._error(f"brackets are nested more than {MAX_DEPTH} deep")
        content = read()
        if not self._take(")"):
            is_end = self._tokens[self._next][0] == "end"
            raise self._error("a closing bracket is missing" if is_end else self._explain_extra())
        self._depth -= 1
        return content
