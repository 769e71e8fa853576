"""Exceptions of the package."""

from __future__ import annotations


class Error(ValueError):
    """A bad file, scene or argument: what was found, where, and what was expected.

    ``str()`` of it is "file:line:column: key: message", without the parts that are unknown.
    """

    def __init__(self, message: str, code: str = "BadValue", file: str = "", line: int = 0, column: int = 0, key: str = "") -> None:
        self.message = message  #: one sentence
        self.code = code  #: BadUsage, FileNotFound, BadSyntax, BadValue, BadMesh, MissingTool, ToolFailed, CannotWrite or NotFinite
        self.file = file  #: empty: not about a file
        self.line = line  #: from 1; 0: unknown
        self.column = column  #: from 1; 0: unknown
        self.key = key  #: path of the scene's key, as in bodies.liver.material.density, or an argument's name
        super().__init__(message, code, file, line, column, key)

    @property
    def expected(self) -> str:
        """What the message says was expected; empty where it names nothing."""
        return self.message.partition("expected ")[2]

    def __str__(self) -> str:
        place = ":".join([self.file] + [str(n) for n in (self.line, self.column) if n > 0]) if self.file else ""
        return ": ".join(part for part in (place, self.key, self.message) if part)


class StoppedError(RuntimeError):
    """A simulator whose state left its bounds was asked for another step."""
