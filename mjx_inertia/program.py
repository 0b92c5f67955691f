"""A Hydra program whose failures are one sentence.

In: the name of a configuration in `configs/`, how it becomes settings and what is done with them.
Out: a run folder for each job. `HYDRA_FULL_ERROR=1` asks for tracebacks.
"""

import contextlib
import os
import sys
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import NoReturn, TypeVar

import hydra
from hydra.core.hydra_config import HydraConfig
from hydra.errors import HydraException, OverrideParseException
from hydra.types import RunMode
from omegaconf import DictConfig
from omegaconf.errors import ConfigAttributeError, ConfigKeyError, OmegaConfBaseException

from mjx_inertia.settings import CONFIGS

Settings = TypeVar("Settings")

FULL_ERROR = "HYDRA_FULL_ERROR"  # asks for tracebacks


class JobFailed(Exception):
    """A job of a `-m` sweep failed and has said why; the others run nevertheless."""


def run_program(
    name: str, read: Callable[[DictConfig], Settings], work: Callable[[Settings, Path], None]
) -> None:
    """Runs the job that the command line asks for, or each job of a `-m` sweep.

    Args:
      name: of the configuration.
      read: settings of a composed configuration; its `ValueError` is a fault of the command line.
      work: to do with them, and the run folder. Its `ValueError`, `RuntimeError` or `OSError`
        leaves `error.txt` in the folder.

    Raises:
      SystemExit: something is wrong, in one sentence; in a sweep after all jobs have run. 130
        after an interrupt from the keyboard.
    """
    full_error = os.environ.get(FULL_ERROR)

    def job(config: DictConfig) -> None:
        _set_environment(FULL_ERROR, full_error)
        folder = Path(HydraConfig.get().runtime.output_dir)
        settings = None
        try:
            settings = read(config)
            work(settings, folder)
        except (ValueError, RuntimeError, OSError) as error:
            if full_error:
                raise
            sentence = f"error: {error}"
            if settings is not None:
                with contextlib.suppress(OSError):  # the disk may be what fails
                    (folder / "error.txt").write_text(traceback.format_exc())
                    sentence += f" (where: {folder / 'error.txt'})"
            _end_job(sentence)
        finally:
            os.environ[FULL_ERROR] = "1"

    # Hydra then raises its errors instead of printing them over several lines.
    os.environ[FULL_ERROR] = "1"
    try:
        hydra.main(version_base="1.3", config_path=str(CONFIGS), config_name=name)(job)()
    except JobFailed:
        raise SystemExit(1) from None
    except KeyboardInterrupt:
        if full_error:
            raise
        print("interrupted: what is stored stays, the same command goes on after it",
              file=sys.stderr)  # fmt: skip
        raise SystemExit(130) from None
    except (HydraException, OmegaConfBaseException) as error:
        if full_error:
            raise
        raise SystemExit(f"error: {_sentence(error)}") from None
    except OSError as error:  # of Hydra, which makes the run folder
        if full_error:
            raise
        raise SystemExit(f"error: {error}") from None
    finally:
        _set_environment(FULL_ERROR, full_error)


def _end_job(sentence: str) -> NoReturn:
    """Ends a single job's program, or one job of a sweep."""
    if HydraConfig.get().mode is RunMode.MULTIRUN:
        print(sentence, file=sys.stderr)
        raise JobFailed(sentence) from None
    raise SystemExit(sentence) from None


def _set_environment(name: str, value: str | None) -> None:
    os.environ.pop(name, None)
    if value is not None:
        os.environ[name] = value


def _sentence(error: Exception) -> str:
    """What Hydra found wrong, on one line."""
    if isinstance(error, OverrideParseException):
        return f"{error.override!r}: expected name=value, with special characters in quotes"
    lines = [line.strip().rstrip(".") for line in str(error).splitlines() if line.strip()]
    if isinstance(error.__cause__, ConfigAttributeError | ConfigKeyError):  # an unknown name
        return f"{lines[0]}: --help lists the options"
    return "; ".join(lines)
