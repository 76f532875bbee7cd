"""Figures and tables of a verdict."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from math import inf
from typing import TYPE_CHECKING, Any

from ..comparison.names import effect_name, effect_names, site_name
from ..core.text import percent, quantity, short_z, with_interval
from ..data.channels import channel_unit, is_channel
from ..identification.error import ForceError
from ..physics.drive import Drive, text_for, unit_for
from ..physics.effect import EFFECTS
from ..physics.laws import LAWS
from ..view.blocks import Block, Figure, Table, Text, View, view_of
from ..view.style import BLUE, FLOOR, GREY, INK, PALE, Page, look
from . import words
from .by_label import EXTRAPOLATED, NOT_SEPARABLE
from .law_trials import FORM_ALONE
from .verdict import Diagnosis

if TYPE_CHECKING:
    from matplotlib.axes import Axes


MOST = 10
"""Effects that are drawn."""
_WHY = 3
"""Sentences of the answer that say why; the others are details."""
_ROLES = {"holdout": "held-out runs", "train": "training runs"}
_Z = "z: error / noise; a true model has 1."


@view_of(Diagnosis)
def diagnosis_view(found: Diagnosis) -> View:
    """Return the view of a verdict."""
    return verdict_view(found.as_dict())


def verdict_view(verdict: words.Verdict) -> View:
    """Return the view of the content of verdict.json."""
    kind, why = str(verdict["kind"]), words.reasons(verdict)
    # Never left to the details: what is to be done before there is a verdict, that another law
    # explains what is named, and which runs say less of a label than they seem to.
    seen = ("study.toml", FORM_ALONE, EXTRAPOLATED, NOT_SEPARABLE)
    asks = [one for one in why if kind == "insufficient" or any(word in one for word in seen)]
    told = [text for text in why if text not in asks]
    shown, apart = told[:_WHY], told[_WHY:]
    named = [_about(str(name), verdict) for name in verdict.get("effects") or []]
    hidden = words.untestable(verdict)
    notes = words.fault_texts(verdict, " ".join(why))
    if role := _judged(verdict):
        notes += ForceError.of(verdict["error"][role]).beside()
    notes += [*asks, *(verdict.get("notes") or [])]
    if hidden:
        notes.append(f"Not testable with these runs: {', '.join(hidden)}.")
    separate = words.separating(verdict)
    return View(
        words.headline(verdict),
        (
            *map(Text, named),
            Text(error_text(verdict)),
            *map(Text, shown),
            Text(f"To distinguish them: {separate}" if separate else ""),
            *(Text(f"{note.rstrip('.')}.", "note") for note in notes),
        ),
        (
            *map(Text, apart), *_tables(verdict),
        ),
        words.TONES[kind],
    )  # fmt: skip


def _about(name: str, verdict: words.Verdict) -> str:
    """Return what an effect is, and its parameters with their 95 % intervals."""
    known, drive = EFFECTS[name].parameters if name in EFFECTS else {}, words.drive_of(verdict)
    values = {
        own: (one["value"], one["std"], unit_for(known[own].unit, drive) if own in known else "1")
        for found in verdict.get("findings") or []
        for key, one in (found.get("values") or {}).items()
        for effect, _, own in [key.partition(".")]
        if effect == name
    }
    return effect_text(name, values, drive)


def effect_text(
    name: str, values: Mapping[str, tuple[float, float | None, str]], drive: Drive
) -> str:
    """Return what an effect is, and its parameters with their 95 % intervals.

    Parameters
    ----------
    name : of the effect
    values : by parameter the value, its standard deviation if one is known, and the unit
    drive : what commands the damper
    """
    parts = []
    effect = EFFECTS.get(name)
    known = effect.parameters if effect is not None and effect.changes else {}
    for key, (value, std, unit) in values.items():
        if effect is not None and key in effect.assumed:  # no fit moves it
            continue
        # What each psi or degree changes a parameter by is known as that alone.
        what = f" ({known[key].text})" if key in known else ""
        text, half = with_interval(value, std)
        spread = "" if half == "-" else f" {half}"
        parts.append(f"{key} = {text}{spread}" + ("" if unit == "1" else f" {unit}") + what)
    sizes = f" {', '.join(parts)} (95 %)." if parts else ""
    return words.about(name, drive) + sizes


def worst(verdict: words.Verdict) -> Mapping[str, Any]:
    """Return the finding at the site whose model errs the most; first one whose noise is unknown.

    Such a site has no z: what effects gain there is told first.
    """
    findings = [one for one in verdict.get("findings") or [] if "z_holdout_before" in one]
    z_before = ((inf if (z := one["z_holdout_before"]) is None else z, one) for one in findings)
    return max(z_before, key=lambda pair: pair[0], default=(0.0, verdict))[1]


def _gain(verdict: words.Verdict) -> str:
    """Return how the error falls with what is named; "" where nothing is, or that is not known."""
    at = worst(verdict)
    both = [at.get(f"error_holdout_{when}") for when in ("before", "after")]
    if at.get("kind") != "effect" or not all(both):
        return ""
    before, after = (ForceError.of(one).text() for one in both if one)
    where = f" at {site_name(at['site'])}" if len(verdict["findings"]) > 1 else ""
    return f"; fitted again{where} {before}, with {effect_names(at['effects'])} {after}"


def error_text(verdict: words.Verdict) -> str:
    """Return the error of the model as the study has it, which every command prints alike."""
    role = _judged(verdict)
    if not role:
        return _error_of_law(verdict)
    sites = (verdict.get("error_by_site") or {}).get(role, {})
    by_site = [f"{site_name(site)} {ForceError.of(one).text()}" for site, one in sites.items()]
    more = f" ({', '.join(by_site)})" if len(by_site) > 1 else ""
    error = ForceError.of(verdict["error"][role]).text()
    which = f"Force error of the study's model on the {_ROLES[role]}"
    return f"{which}: {error}{more}{_gain(verdict)}."


def _error_of_law(verdict: words.Verdict) -> str:
    """Return the error of the law of a verdict, where a study's own model has none."""
    at = worst(verdict)
    before, after = (at.get(f"error_holdout_{when}") for when in ("before", "after"))
    if not before:
        return ""
    own = words.law_name(verdict) if verdict.get("laws") else "the model"
    then = ""
    if after and at.get("kind") == "effect":
        then = f", with {effect_names(at['effects'])} {ForceError.of(after).text()}"
    return f"Force error of {own} on the held-out runs: {ForceError.of(before).text()}{then}."


def _judged(verdict: words.Verdict) -> str:
    return next((role for role in _ROLES if role in (verdict.get("error") or {})), "")


def _tables(verdict: words.Verdict) -> list[Block]:
    """Return the evidence: faults, laws, trials, limits, and what could not be tested."""
    blocks: list[Block] = []
    if faults := words.fault_rows(verdict):
        blocks.append(Table(words.FAULTS, faults, title="Faults of channels"))
    if laws := verdict.get("laws"):
        blocks.append(law_block(laws))
    alt = f"error / noise (z) with each effect: {words.headline(verdict)}"
    blocks.append(Figure(lambda: draw_verdict(verdict), alt))
    blocks += _trials(verdict)
    if limits := words.limit_rows(verdict):
        title, note = "How large each effect may still be", " ".join(words.LIMITS_NOTES)
        blocks.append(Table(words.LIMITS, limits, (2, 3), title, note=note))
    if hidden := words.untestable(verdict):
        drive, rows = words.drive_of(verdict), []
        for effect, name in zip(hidden, map(str, verdict["untestable"]), strict=True):
            expect = text_for(EFFECTS[name].expect, drive) if name in EFFECTS else ""
            rows.append([effect, words.about(name, drive), expect])
        header = ("effect", "what it does", "what it would look like")
        note = "They may be present: these runs do not excite them, or the model hides them."
        blocks.append(Table(header, rows, title="Not testable with these runs", note=note))
    floor = [
        f"{name} {quantity(value, channel_unit(name) if is_channel(name) else '1', fine=True)}"
        for name, value in (verdict.get("noise_floor") or {}).items()
        if isinstance(value, int | float)
    ]
    return [*blocks, Text(f"Noise floor of the verdict: {', '.join(floor)}." if floor else "")]


def law_block(rows: Sequence[words.Verdict]) -> Table:
    """Return the table of laws, from its rows as verdict.json has them.

    Without the form of the command where laws without one were tried: nothing commands the damper.
    """
    told, laws = [*range(len(words.HEADER))], [LAWS.get(str(row["law"])) for row in rows]
    if any(law is not None and not law.own and not law.has("command") for law in laws):
        told.remove(words.HEADER.index("command"))
    cells = [[row[k] for k in told] for row in words.law_table(rows)]
    right = range(len(told) - 6, len(told))
    return Table([words.HEADER[k] for k in told], cells, right, "The laws", note=words.TABLE_NOTE)


def _trials(verdict: words.Verdict) -> list[Block]:
    """Return the table of what each effect leaves of the error, the largest gain first."""
    ranking, known = verdict.get("ranking") or [], verdict.get("noise_known", True)
    if not ranking:
        return []
    several = len({row.get("site") for row in ranking}) > 1
    at, named = worst(verdict), set(verdict.get("effects") or [])
    where = f" ({at['site']})" if several else ""
    model = f"{verdict['law']} alone" if verdict.get("laws") else "present model"
    z = [at.get("z_train_before"), at.get("z_holdout_before")]
    rows = [[model + where, *map(_z, z), "", ""]] if known else []
    strong = []
    for row in ranking:
        if row["effect"] in named:
            strong.append(len(rows))
        z = [row.get("z_train"), row.get("z_holdout")]
        gain = percent(row["gain"]) if row.get("gain") is not None else "not tried"
        search = "full" if row.get("refined", True) else "short"
        if search == "short" and (row.get("gain") or 0.0) < 0.0:
            gain = "nothing"  # the fit was not brought to its end: it says no more than that
        site = f" ({row['site']})" if several else ""
        named_so = f"with {effect_name(row['effect'])}{site}"
        rows.append([named_so, *(map(_z, z) if known else ()), gain, search])
    z_columns = ("z train", "z held out") if known else ()
    header = ("model", *z_columns, "error lower by", "fit")
    note = (
        "Each effect added to the model, all parameters fitted again; held-out runs decide. Short: "
        "a first fit gained too little to go on, and was left before its end."
    )
    numbers = range(1, len(header) - 1)
    note = f"{_Z} {note}" if known else note
    return [Table(header, rows, numbers, "The evidence", strong, note)]


def _z(value: float | None) -> str:
    return "not known" if value is None else f"{value:.3f}"


def draw_verdict(verdict: words.Verdict) -> Page:
    """Return the figure of a verdict: what each effect that was tried leaves of the error.

    Of a building it shows the site where the model errs the most, the best effect first, with the
    pair of effects that was found. Data that carry no verdict have no trials, without a known noise
    there is no z: then the figure is the verdict's words.
    """
    at, before = worst(verdict), worst(verdict).get("z_holdout_before")
    rows = [
        (str(row["effect"]), float(row["z_holdout"]))
        for row in verdict.get("ranking") or []
        if row.get("z_holdout") is not None and row.get("site") == at.get("site", row.get("site"))
    ][:MOST]
    with look():
        if not rows or before is None or not verdict.get("noise_known", True):
            return Page(7.6, 0.0, words.headline(verdict), " ".join(words.reasons(verdict)))
        own = [str(name) for name in at.get("effects") or []]
        if at.get("kind") == "effect" and len(own) > 1 and at.get("z_holdout_after") is not None:
            rows.append((" and ".join(own), float(at["z_holdout_after"])))
        rows.sort(key=lambda row: row[1])
        without = "the present model"
        if verdict.get("laws"):
            without = f"{words.law_name(verdict)}, the law of this verdict, alone"
        if at.get("site") not in (None, "damper"):
            without += f" at {site_name(at['site'])}"
        page = Page(
            7.6, ROW * len(rows) + 1.0, words.headline(verdict),
            "Each bar: the model with that effect, fitted again. Green: the noise floor.",
        )  # fmt: skip
        grid = page.grid(1, 1, top=0.3, bottom=0.5, left=1.9, right=0.7)
        axes = page.figure.add_subplot(grid[0, 0])
        named = {_label(name) for name in (*(verdict.get("effects") or ()), " and ".join(own))}
        names, values = [_label(name) for name, _ in rows], [z for _, z in rows]
        draw_ranking(axes, names, values, float(before), named)
        axes.set_title(f"dashed: {without}, z = {short_z(before)}", loc="right", fontsize=8.5)
        axes.set_xlabel("error / noise on held-out runs (z)")
    return page


def _label(name: str) -> str:
    """Return an effect, or a pair of them, as it stands beside its bar: a pair in two lines."""
    return "with " + "\nand ".join(map(effect_name, name.split(" and ")))


# Values of several candidates as bars, over the band that noise explains.

ROW = 0.27
"""Height of a candidate's row [in]."""
_SHORT = 0.05
"""Distance of a value from 1 below which its bar would not be seen: a dot is."""


BAND = (0.9, 1.1)
"""Values of z that noise explains."""


def draw_ranking(
    axes: Axes, names: Sequence[str], values: Sequence[float], before: float,
    strong: Collection[str] = (),
) -> None:  # fmt: skip
    """Draw what each candidate leaves of a value: a bar from what noise explains to the value.

    Parameters
    ----------
    axes : where to draw
    names : of the candidates
    values : one per candidate, positive
    before : the value without any candidate, a line
    strong : names that are drawn in colour
    """
    axes.set_xscale("log")
    axes.axvspan(*BAND, color=FLOOR, lw=0.0)
    axes.axvline(before, color=GREY, lw=0.9, linestyle=(0, (3, 2)))
    for row, (name, value) in enumerate(zip(names, values, strict=True)):
        colour = BLUE if name in strong else PALE
        if abs(value - 1.0) < _SHORT:
            axes.plot([value], [row], "o", ms=5.0, color=colour)
        else:
            axes.barh(row, value - 1.0, left=1.0, height=0.62, color=colour)
        axes.text(
            1.02, row, short_z(value), transform=axes.get_yaxis_transform(), va="center",
            fontsize=8.5, color=INK if name in strong else GREY,
        )  # fmt: skip
    axes.set_yticks(range(len(names)), names, fontsize=9, color=INK)
    axes.tick_params(axis="y", length=0)
    axes.set_ylim(len(names) - 0.4, -0.6)
    low, high = min([*values, before, 0.8]), max([*values, before, 2.0])
    axes.set_xlim(0.93 * low, 1.1 * high)
    steps = [z for z in (0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 1e3) if low <= z <= high]
    axes.set_xticks(steps, [f"{z:g}" for z in steps])
    axes.xaxis.set_minor_formatter(lambda _value, _place: "")
    axes.grid(visible=False, axis="y")
