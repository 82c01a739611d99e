"""Text as editors and spreadsheets write it: decoded, and which of its words are numbers."""

from __future__ import annotations

import codecs


def decoded(data: bytes) -> str:
    """Decode UTF-8, with or without a byte order mark; line ends of any system become "\\n".

    Raises:
        ValueError: it is in another encoding, or no text.
    """
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)) or 0 in data:
        raise ValueError("it is in UTF-16, or no text at all; save it as text in UTF-8")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as cause:
        raise ValueError(f"it is not in UTF-8 ({cause}); save it so") from None
    return text.replace("\r\n", "\n").replace("\r", "\n")


def is_number(word: str) -> bool:
    """Whether a word of a text is a number, infinite ones and NaN included."""
    try:
        float(word)
    except ValueError:
        return False
    return True
