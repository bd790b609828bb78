"""The command line `icing`: its verbs, and the one place where an error becomes a line and an exit code.

Adding a verb: write testbed/commands/<verb>.py with a `command` made by `testbed.commands.common.verb`, and add its
line to VERBS. A verb's module is imported when the verb is called; it imports what is slow inside its function.
"""

from __future__ import annotations

import os
import sys
import traceback
from collections.abc import Sequence
from importlib import import_module

import click

from icing_env.errors import InputError, nearest

VERBS = {
    "demo": "Fly the demonstration and write its report.",
    "fly": "Fly a scenario and write its record.",
    "effects": "List the ways in which an aircraft may differ from its model.",
    "compare": "Fly controllers with and without protection on the same cases.",
    "reproduce": "Put the founding paper's numbers beside ours.",
    "benchmark": "Measure the testbed: speed, diagnosis, ice told, protection, control, real flight.",
    "identify": "Estimate aerodynamic derivatives from flight records.",
    "characterise": "Tell the ice on each surface, its onset, and whether protection works.",
    "train": "Learn a controller.",
    "diagnose": "Find the effect behind a gap between model and aircraft.",
}
PATH_ERRORS = (FileNotFoundError, PermissionError, IsADirectoryError, NotADirectoryError)


class Verbs(click.Group):
    """The verbs of VERBS, each imported only when it is asked for."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Names in the order of VERBS."""
        return list(VERBS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """The command of one verb, or None if there is no such verb."""
        if cmd_name not in VERBS:
            return None
        command: click.Command = import_module(f"testbed.commands.{cmd_name}").command
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """As click does, but an unknown verb is told with the nearest one."""
        if args and args[0] not in VERBS and not args[0].startswith("-"):
            raise InputError(f"no verb '{args[0]}': {nearest(args[0], list(VERBS))}")
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """The list in `icing --help`, from VERBS alone, so that nothing slow is imported for it."""
        with formatter.section("Verbs"):
            formatter.write_dl(list(VERBS.items()))


@click.group(cls=Verbs, subcommand_metavar="VERB ...")
@click.version_option(package_name="icing-testbed", message="%(package)s %(version)s")
def icing() -> None:
    """Fly, identify and protect an aircraft that is icing up.

    `icing VERB --help` explains a verb with an example. Every verb takes --json (for machines) and --seed, and
    returns 0 on success, 2 on bad input, 1 on any other error. ICING_DEBUG=1 shows where an error came from.
    """


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and exit: 0 done, 2 bad input, 1 any other error, 130 interrupted."""
    args = list(sys.argv[1:] if arguments is None else arguments)
    sys.exit(_run(args or ["--help"]))


def _run(args: list[str]) -> int:
    try:
        code = icing.main(args=args, prog_name="icing", standalone_mode=False)
        sys.stdout.flush()
        return code if isinstance(code, int) else 0
    except click.UsageError as problem:
        path = problem.ctx.command_path if problem.ctx else "icing"
        return _say(f"{problem.format_message()} (see {path} --help)", problem, 2)
    except click.ClickException as problem:
        return _say(problem.format_message(), problem, 2)
    except InputError as problem:
        return _say(str(problem), problem, 2)
    except (click.Abort, KeyboardInterrupt):
        return 130
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # the reader has gone: nothing more to flush
        return 1
    except PATH_ERRORS as problem:
        return _say(f"{problem.filename}: {str(problem.strerror).lower()}", problem, 2)
    except Exception as problem:
        return _say(f"{type(problem).__name__}: {problem} (ICING_DEBUG=1 shows where)", problem, 1)


def _say(message: str, problem: BaseException, code: int) -> int:
    """One line on standard error, after the traceback if ICING_DEBUG asks for it; returns `code`."""
    if os.environ.get("ICING_DEBUG"):
        traceback.print_exception(problem)
    print("icing: " + " ".join(message.split()), file=sys.stderr)
    return code


if __name__ == "__main__":
    main()
