"""The command line in the tests' own process."""

import shlex

from typer.testing import CliRunner, Result

from rail_fem.cli import app


def call(*words: object, code: int = 0, **environment: str) -> Result:
    """What `rail-fem WORDS` answered, with these variables of the environment; its exit code has to be `code`."""
    line = [str(word) for word in words]
    answer = CliRunner(env=environment).invoke(app, line)
    assert answer.exit_code == code, f"rail-fem {shlex.join(line)}\n{answer.output[-4000:]}\n{answer.exception!r}"
    return answer
