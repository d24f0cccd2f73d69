"""Which models there are, by name: known without reading one."""

from difflib import get_close_matches
from importlib.resources import files
from pathlib import Path

from .core.structure import ModelError


def ready_models() -> dict[str, Path]:
    """The models that ship with the package, by name."""
    folder = Path(str(files("crash_estimator") / "models"))
    return {path.stem: path for path in sorted(folder.glob("*.yaml"))}


MODEL = f"a .yaml file, or one of {', '.join(ready_models())}"
"""What a model may be given as."""


def model_path(name_or_path: str | Path) -> Path:
    """The file of a ready model by its name, or the path itself."""
    path = Path(name_or_path)
    if path.suffix in (".yaml", ".yml"):
        return path
    ready = ready_models()
    if str(name_or_path) not in ready:
        near = get_close_matches(str(name_or_path), ready, n=1)
        hint = f"; did you mean {near[0]!r}?" if near else ""
        raise ModelError(
            f"there is no model {str(name_or_path)!r}: give one of {', '.join(ready)}, "
            f"or the path of a .yaml file{hint}"
        )
    return ready[str(name_or_path)]
