"""Text that people type: names of runs and of levels. One rule for forms, bodies and commands.

It is stored in Unicode's normal form C, without blanks around it. What nobody could see or what disturbs
other text is refused with a sentence. Direction is a matter of what shows a text: pages isolate it, and
commands and logs print by `printable`, since what older versions or other programs stored may hold anything.
"""

from __future__ import annotations

import unicodedata

LONGEST = 100
"""Characters of a name."""
MARKS = 8
"""Combining marks on one character; living scripts use fewer."""
BLANK = frozenset("\u034f\u115f\u1160\u17b4\u17b5\u2800\u3164\uffa0")
"""Characters that look like nothing though Unicode counts them as letters, marks or symbols."""
SIGNS = frozenset({"LRE", "RLE", "LRO", "RLO", "PDF", "LRI", "RLI", "FSI", "PDI"})
"""Unicode's classes of signs that set the direction of what follows."""
SETTING = SIGNS - {"FSI", "PDI"}
"""Those of them that an isolate does not consist of."""
RIGHT_TO_LEFT = SIGNS | {"R", "AL"}
BREAKS = frozenset("\n\r\t\u2028\u2029")


def read_name(text: str) -> str:
    """Return a name as it is stored.

    Raises:
        ValueError: it cannot be seen, is too long, or holds what no name may hold; the message says which.
    """
    name = unicodedata.normalize("NFC", plain(text)).strip()
    if BREAKS & set(name):
        raise ValueError("line ends and tabs are not allowed here")
    if not is_visible(name):
        raise ValueError("nothing of this can be seen; write at least one letter, digit or sign")
    if len(name) > LONGEST:
        raise ValueError(f"at most {LONGEST} characters are allowed here")
    if _most_marks(name) > MARKS:
        raise ValueError(f"at most {MARKS} combining marks on one character are allowed here")
    return name


def plain(text: str) -> str:
    """Refuse control characters (except line ends and tabs) and text that UTF-8 cannot store.

    Raises:
        ValueError: the text holds one; the message names it.
    """
    for character in text:
        kind = unicodedata.category(character)
        if kind == "Cc" and character not in BREAKS:
            raise ValueError(f"the control character U+{ord(character):04X} is not allowed here")
        if kind == "Cs":
            raise ValueError("half of a surrogate pair is not allowed here")
    return text


def sign(character: str) -> str:
    """Return a character in quotation marks, with its name where it may be taken for another one."""
    if character.isascii():
        return repr(character)
    return f"{character!r} ({unicodedata.name(character, f'U+{ord(character):04X}').lower()})"


def is_visible(text: str) -> bool:
    """Return whether something of a text can be seen: not blanks, zero-width or directional signs alone."""
    return any(unicodedata.category(one)[0] in "LNPS" and one not in BLANK for one in text)


def _most_marks(text: str) -> int:
    most = now = 0
    for character in text:
        now = now + 1 if unicodedata.category(character) in ("Mn", "Me") else 0
        most = max(most, now)
    return most


def isolated(text: str) -> str:
    """Return a text for a place that takes no markup, so that its direction changes nothing around it.

    A text without a letter or a sign of direction from right to left is returned as it is.
    """
    kinds = {unicodedata.bidirectional(one) for one in text}
    if not kinds & RIGHT_TO_LEFT:
        return text
    within = "".join(one for one in text if unicodedata.bidirectional(one) not in SIGNS)
    return f"\u2068{within}\u2069"


def printable(text: str, breaks: bool = True) -> str:
    """Return a text for a terminal or a log: what would steer it is written as an escape such as \\x1b.

    Control characters, halves of surrogate pairs, separators of lines and signs that set the direction are
    such; the isolates of `isolated` stand.

    Args:
        text: The text.
        breaks: Whether line ends and tabs stand, too.
    """
    return "".join(_escaped(one) if _steers(one, breaks) else one for one in text)


def _steers(character: str, breaks: bool) -> bool:
    if character in "\n\t":
        return not breaks
    kind = unicodedata.category(character)
    return kind in ("Cc", "Cs", "Zl", "Zp") or unicodedata.bidirectional(character) in SETTING


def _escaped(character: str) -> str:
    if character.isascii():
        return repr(character)[1:-1]
    return character.encode("ascii", "backslashreplace").decode()
