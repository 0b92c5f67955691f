"""Random damage to files: what disks, editors, careless writers and forgers leave.

In: content and a generator. Out: other content.
"""

import re

from numpy.random import Generator

_NUMBER = re.compile(rb"(?<![\w.#-])-?\d+\.?\d*(?:[eE][+-]?\d+)?(?![\w.])")
_SWAPS = (
    b"nan", b"NaN", b"inf", b"-1e308", b"1e400", b"-1", b"0", b"1e-300", b"x", b"", b"null",
    b"[]", b"9" * 400, b"true", b'"1"',
)  # fmt: skip


def mutate_bytes(content: bytes, rng: Generator) -> bytes:
    """Truncated, or with flipped bits, zeroed, repeated or removed pieces."""
    data = bytearray(content)
    place, size = int(rng.integers(len(data))), int(rng.integers(1, 1 + len(data) // 4))
    match int(rng.integers(5)):
        case 0:
            del data[place:]
        case 1:
            for _ in range(int(rng.integers(1, 9))):
                data[int(rng.integers(len(data)))] ^= 1 << int(rng.integers(8))
        case 2:
            data[place : place + size] = bytes(len(data[place : place + size]))
        case 3:
            data[place:place] = data[place : place + size]
        case _:
            del data[place : place + size]
    return bytes(data)


def mutate_text(content: bytes, rng: Generator) -> bytes:
    """A number swapped for another thing, a line or word dropped or doubled; or as any bytes."""
    kind = int(rng.integers(6))
    lines = content.splitlines(keepends=True)
    line = int(rng.integers(len(lines)))
    match kind:
        case 0 | 1 | 2:
            if numbers := list(_NUMBER.finditer(content)):
                found = numbers[int(rng.integers(len(numbers)))]
                swap = _SWAPS[int(rng.integers(len(_SWAPS)))]
                return content[: found.start()] + swap + content[found.end() :]
        case 3:
            return b"".join(lines[:line] + lines[line + 1 :])
        case 4:
            return b"".join([*lines[: line + 1], *lines[line:]])
    return mutate_bytes(content, rng)
