"""Images of one policy at several budgets."""

from __future__ import annotations

from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING, Any, Callable, Dict, List, Mapping, Optional, Sequence, Tuple, Union

from ._actq import Error, Image, Policy
from ._evaluate import evaluate
from ._progress import Progress, reporter
from ._quantize import CLOCK, log, measured
from ._rollout import Rollout
from ._typing import Recordings

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: A number of bits per weight, or a budget of `quantize`, as {"flash": "24K"}.
Budget = Union[float, Mapping[str, Any]]


@dataclass(frozen=True)
class Point:
    """An image of a sweep."""

    #: The budget's options.
    budget: Mapping[str, Any]
    image: Image
    #: Error on the held-out recordings, or on parts of the recordings that were held out; on all of them if none could be,
    #: which the log `actq` says. `None` without recordings.
    nmse: Optional[float]
    #: Predicted time of a step on the core, by default a Cortex-M4.
    milliseconds: float
    #: Its rollout; `None` if the sweep has none.
    rollout: Optional[Rollout]

    @property
    def success(self) -> Optional[float]:
        """Share of the rollout's episodes that succeeded; `None` if that is not known."""
        return self.rollout.success if self.rollout else None


@dataclass(frozen=True)
class Sweep:
    """Images of one policy, in the order of their budgets."""

    points: Sequence[Point]

    def rows(self) -> List[Dict[str, Any]]:
        """Returns a row for each image, as `pandas.DataFrame` takes them. What is not known is missing."""
        return [{key: value for key, value in _row(point).items() if value is not None} for point in self.points]

    def __str__(self) -> str:
        cells = self._cells()
        widths = [max(map(len, column)) for column in zip(*cells)]
        return "\n".join("  ".join(map(str.rjust, row, widths)).rstrip() for row in cells)

    __repr__ = __str__

    def _repr_html_(self) -> str:
        head, *rows = self._cells()
        return "<table>" + _line("th", head) + "".join(_line("td", row) for row in rows) + "</table>"

    def _cells(self) -> List[List[str]]:
        rows = self.rows()
        keys = [key for key in _row(self.points[0]) if any(key in row for row in rows)] if rows else []
        return [keys, *([_text(row.get(key, "-")) for key in keys] for row in rows)]

    def plot(self) -> Figure:
        """Draws error, and success if it is known, over bytes and milliseconds. Needs matplotlib."""
        try:
            from matplotlib.figure import Figure
        except ImportError as error:
            raise Error(f"plots need matplotlib ({error}); pip install matplotlib") from error
        known = [point.success for point in self.points if point.success is not None]
        measures: List[Tuple[str, Callable[[Point], Optional[float]]]] = [("held-out NMSE", lambda point: point.nmse)]
        measures += [("success", lambda point: point.success)] if known else []
        costs: List[Tuple[str, Callable[[Point], float]]] = [
            ("bytes of the image", lambda point: len(point.image)),
            ("milliseconds of a step, predicted", lambda point: point.milliseconds),
        ]
        figure = Figure(figsize=(9, 3.2 * len(measures)), layout="constrained")
        axes = figure.subplots(len(measures), 2, squeeze=False, sharey="row")
        for row, (measure, value) in zip(axes, measures):
            for ax, (cost, at) in zip(row, costs):
                pairs = sorted((at(point), shown) for point in self.points for shown in [value(point)] if shown is not None)
                ax.plot([x for x, _ in pairs], [y for _, y in pairs], marker="o")
                ax.set_xlabel(cost)
                ax.grid(alpha=0.3)
            row[0].set_ylabel(measure)
            if measure == "success":
                row[0].set_ylim(-0.02, 1.02)
            else:
                row[0].set_yscale("log")
        return figure


def _text(value: Any) -> str:
    return f"{value:.3g}" if isinstance(value, float) else str(value)


def _line(tag: str, cells: Sequence[str]) -> str:
    return "<tr>" + "".join(f"<{tag}>{escape(cell)}</{tag}>" for cell in cells) + "</tr>"


def _row(point: Point) -> Dict[str, Any]:
    return {
        "budget": " ".join(f"{key}={value}" for key, value in point.budget.items()),
        "bytes": len(point.image),
        "bits per weight": point.image.bits_per_weight,
        "ms": point.milliseconds,
        "NMSE": point.nmse,
        "success": point.success,
        "return": point.rollout.mean_return if point.rollout else None,
    }


def sweep(
    policy: Policy,
    recordings: Optional[Recordings] = None,
    *,
    budgets: Sequence[Budget] = (1.0, 1.5, 2.0, 3.0, 4.0),
    heldout: Optional[Recordings] = None,
    drive: Optional[Callable[[Image], Rollout]] = None,
    clock: float = CLOCK,
    progress: Progress = None,
    **options: Any,
) -> Sweep:
    """Quantizes a policy at several budgets, measures each image on frames that it did not learn from, and drives it.

    policy, recordings: as for `quantize`.
    budgets: bits per weight, or budgets of `quantize`, as {"flash": "24K"} or {"ms": 0.6}.
    heldout: recordings that nothing learns from; {"max_nmse": X} chooses the size by them. Without them, parts of `recordings`
        are held out for each image, as `quantize` does.
    drive: drives an image, as `lambda image: actq.rollout(actq.Head(image, env.num_envs), env, episodes=100)`.
    clock: clock in Hz of the predicted milliseconds.
    options: other options of `quantize`, for all budgets. With core=, milliseconds are those of that core.

    The result prints as a table, `rows()` are its rows, and `plot()` draws it. A budget that cannot be kept is left out, with
    a warning in the log `actq`. Raises what `drive` raises, and `actq.Error` if no budget can be kept.
    """
    each = [dict(budget) if isinstance(budget, Mapping) else {"bpw": budget} for budget in budgets]
    if not each:
        raise Error("budgets is empty; pass bits per weight, or budgets such as {'flash': '24K'}")
    points, failure = [], None
    with reporter(progress) as report:
        for i, budget in enumerate(each):
            name = " ".join(f"{key}={value}" for key, value in budget.items())

            def show(work: str, share: float) -> None:
                if report is not None:
                    report(f"{name}: {work}", (i + share) / len(each))  # noqa: B023

            try:
                settings = {"clock": clock, **options, **budget}
                image, nmse = measured(policy, recordings, heldout, show, **settings)
                if heldout is not None:
                    # Of all frames.
                    nmse = evaluate(image, heldout, policy).nmse
                milliseconds = image.cost(clock=settings["clock"], core=settings.get("core"))["milliseconds"]
            except Error as error:
                log.warning("%s: %s", name, error)
                failure = error
                continue
            driven = drive(image) if drive is not None else None
            points.append(Point(budget, image, nmse, milliseconds, driven))
    if failure is not None and not points:
        raise failure
    return Sweep(points)
