"""The one exception for input that a user can mend."""


class InputError(ValueError):
    """Bad input, told in one line: what is wrong, where, and what would be right.

    The command line prints the message on standard error and exits with 2.
    """


def nearest(name: str, valid: list[str]) -> str:
    """Hint for a name that is not valid: the nearest valid one, or all of them.

    Args:
        name: what the user wrote.
        valid: the names that would have been right.

    Returns:
        A clause to end an error message with.
    """
    from difflib import get_close_matches

    close = get_close_matches(name, valid, n=1, cutoff=0.5)
    return f"did you mean '{close[0]}'?" if close else f"valid are: {', '.join(sorted(valid))}"
