"""Reading the data files under configs/: found in the checkout or in the installed package, checked key by key."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any, TypeVar, get_args

from pydantic import BaseModel, ConfigDict, ValidationError

from icing_env.errors import InputError, nearest


def folder() -> Path:
    """The configs folder: inside the installed package, else beside it in a checkout."""
    here = Path(__file__).resolve().parent
    return here / "configs" if (here / "configs").is_dir() else here.parent / "configs"


def available(kind: str) -> list[str]:
    """Names of the files of one kind ('aircraft', 'scenarios', ...)."""
    return sorted(path.stem for path in (folder() / kind).glob("*.toml"))


def read_toml(kind: str, name: str | Path) -> dict[str, Any]:
    """Read one file by its name within configs/<kind>/, or by a path of the user's own.

    Raises:
        InputError: no such file, or not TOML.
    """
    path = Path(name) if str(name).endswith(".toml") else folder() / kind / f"{name}.toml"
    if not path.is_file():
        raise InputError(f"no {kind} '{name}': {nearest(str(name), available(kind))}")
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as problem:
        raise InputError(f"{path}: not valid TOML: {problem}") from None


T = TypeVar("T", bound=BaseModel)


class Strict(BaseModel):
    """Base of every configuration: frozen, and an unknown key is an error."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class Sourced(Strict):
    """One number with its unit and its source."""

    value: float
    unit: str
    source: str


def validate(model: type[T], data: dict[str, Any], where: str) -> T:
    """Check `data` against a model; the first problem becomes one line that names the nearest valid key.

    Raises:
        InputError: unknown key, missing key, or wrong type.
    """
    try:
        return model.model_validate(data)
    except ValidationError as problem:
        raise InputError(f"{where}: {_explain(model, problem)}") from None


def _explain(model: type[BaseModel], problem: ValidationError) -> str:
    error = problem.errors()[0]
    path = ".".join(str(part) for part in error["loc"])
    if error["type"] == "extra_forbidden":
        return f"unknown key '{path}': {nearest(str(error['loc'][-1]), _keys(model, error['loc'][:-1]))}"
    return f"{path}: {error['msg'].lower()} (got {str(error.get('input'))[:60]!r})"


def _keys(model: type[BaseModel], parents: tuple[Any, ...]) -> list[str]:
    for part in parents:
        field = model.model_fields.get(str(part))
        inner = (field.annotation, *get_args(field.annotation)) if field is not None else ()
        for kind in inner:  # itself, or what a tuple or dict holds
            if isinstance(kind, type) and issubclass(kind, BaseModel):
                model = kind
    return list(model.model_fields)
