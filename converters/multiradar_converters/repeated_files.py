"""Files that were appended to themselves: their content is there several times."""

from pathlib import Path

#: Numbers of copies that are tried.
_COPIES_MAX = 4
#: Octets compared at the start and at the end of each copy; shorter content repeats by accident.
_COMPARED = 1 << 16
_CONTENT_MIN = 256


def copies_in(path: Path) -> int:
    """Return how many times the content of a file is in it; 1 for a usual one."""
    size = path.stat().st_size
    with path.open("rb") as file:

        def octets(begin: int, count: int) -> bytes:
            file.seek(begin)
            return file.read(count)

        for copies in range(_COPIES_MAX, 1, -1):
            length, rest = divmod(size, copies)
            if rest or length < _CONTENT_MIN:
                continue
            count = min(length, _COMPARED)
            head, tail = octets(0, count), octets(length - count, count)
            # Content of one octet, such as zeros of a sparse file, is no recording.
            if len(set(head)) > 1 and all(
                octets(begin, count) == head and octets(begin + length - count, count) == tail
                for begin in range(length, size, length)
            ):
                return copies
    return 1


def repeated_sentence(path: Path) -> str:
    """Return a message about a file that was appended to itself; empty for a usual one."""
    copies = copies_in(path) if path.is_file() else 1
    if copies == 1:
        return ""
    return (
        f"{path}: contains the same content {copies} times: the file was probably appended to "
        "itself; equal records count as duplicates"
    )
