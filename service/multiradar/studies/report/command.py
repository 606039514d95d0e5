"""The command that makes a result again."""

from multiradar.studies.catalogue import FLAGS
from multiradar.studies.result import StudyResult


def command_of(result: StudyResult) -> str:
    """Return the command line that gives the same result.

    Parameters
    ----------
    result : StudyResult
        With the options it ran with.

    Returns
    -------
    str
        One line for a shell.
    """
    parts = ["multiradar", "study", result.study]
    for name, flag in FLAGS.items():
        value = result.options.get(name)
        if isinstance(value, list | tuple):
            parts += [flag, ",".join(map(str, value))]
        elif isinstance(value, float):
            parts += [flag, f"{value:g}"]
        elif value is not None:
            parts += [flag, str(value)]
    return " ".join([*parts, "--seed", str(result.seed)])
