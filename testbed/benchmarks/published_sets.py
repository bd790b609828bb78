"""A set that has been scored, in one file that anybody can score again: answers, keys, gaps flown again, manifest.

Answers are kept without the map of where residuals lie, and what no score reads to DIGITS figures: probabilities that
agree to so many would fall into other bins than they did. Keys and manifest are as they were. Records are not in it,
but the seed is: `testbed.withheld.generate` draws them again beside the keys.
"""

from __future__ import annotations

import io
import json
import lzma
import os
import re
import tarfile
from pathlib import Path

from icing_env.errors import InputError
from testbed.withheld.files import write_text

PARTS = ("answers", "keys", "refly")
WITHOUT = "answers_without"  # to single effects left out of the library: a part of sets where that was asked
DIGITS, WHOLE = 6, ("hypotheses", "effects", "where", "seconds")
MEMBER = re.compile(rf"manifest\.json|(?:{'|'.join((*PARTS, WITHOUT))})/\w+\.json")
LARGEST = 10**7  # bytes of one member


def publish(folder: Path, path: Path) -> None:
    """Write the set in `folder`, an --out of a run that ended, as a tar file compressed by xz; whole or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(f".{path.name}.{os.getpid()}")
    with tarfile.open(part, "w:xz") as archive:
        parts = [f for part in (*PARTS, WITHOUT) for f in sorted((folder / part).glob("*.json"))]
        for member in [folder / "manifest.json", *parts]:
            answer = member.parent.name in ("answers", WITHOUT)
            content = _shortened(member) if answer else member.read_bytes()
            told = tarfile.TarInfo(str(member.relative_to(folder)))
            told.size = len(content)
            archive.addfile(told, io.BytesIO(content))
    os.replace(part, path)


def _shortened(path: Path) -> bytes:
    text = path.read_text(encoding="utf-8")
    whole = json.loads(text)
    answer = json.loads(text, parse_float=lambda number: float(f"{float(number):.{DIGITS}g}"))
    answer |= {part: whole[part] for part in WHOLE if part in whole}
    if "where" in answer:
        answer["where"] = {"components": answer["where"]["components"]}
    return json.dumps(answer).encode()


def unpack(path: Path, into: Path) -> Path:
    """Unpack a published set into a folder, made if absent, and return that.

    Raises:
        InputError: it is not such a file.
    """
    try:
        with tarfile.open(path, "r:xz") as archive:
            for member in archive:
                if not member.isfile() or not MEMBER.fullmatch(member.name) or member.size > LARGEST:
                    raise InputError(f"{path}: holds '{member.name}', which is no file of a published set")
                content = archive.extractfile(member)
                (into / member.name).parent.mkdir(parents=True, exist_ok=True)
                write_text(into / member.name, content.read().decode("utf-8") if content else "")
    except (OSError, tarfile.TarError, lzma.LZMAError, EOFError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: not a published set ({error}); give a file that --publish wrote") from error
    return into
