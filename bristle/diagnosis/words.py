"""A verdict in words, from the content of verdict.json: what commands, reports and programs show.

`sentences` is the verdict as it is read: what is missing first, then why, then what else was seen.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from typing import Any

from ..comparison.names import effect_name, effect_names, name_of, site_name
from ..comparison.words import capitalised
from ..core.text import joined, percent, quantity, short_z
from ..identification.error import ForceError
from ..identification.rig import DAMPER
from ..physics.drive import DRIVES, VOLTAGE, Drive, text_for
from ..physics.effect import EFFECTS, instrument_of
from ..physics.forms import LINEAR_FORM
from .decision import NOISE
from .rule import BENCH
from .sensor_faults import size_text
from .site_diagnosis import SiteDiagnosis

# What a verdict says of laws, in words and as a table, from the content of verdict.json.

Row = Mapping[str, Any]

MOST_EQUAL = 3
"""Pairs of law and effects that a verdict names as doing as well."""

HEADER = (
    "law", "command", "fitted", "z train", "z held out", "z above best", "error train",
    "error held out",
)  # fmt: skip
"""Columns of the table of laws; the last two are those of `ERRORS`."""

ERRORS = ("error_train", "error_holdout")
"""Where a row has the error of the force; one of an earlier version has another error, and none."""

TABLE_NOTE = (
    "z: error / noise; a true model has 1. z above best: mean over the held-out runs, with its "
    "95 % interval. A law that contains a missing effect errs less than the true law without it."
)


def law_name(row: Row) -> str:
    """Return the name of a law with the form of its command: "lugre with a quadratic command"."""
    form = row.get("command") or LINEAR_FORM
    return f"{row['law']} with a {form} command" if form != LINEAR_FORM else str(row["law"])


def law_sentences(verdict: Row) -> list[str]:
    """Return which law the runs prefer, and what explains them as well.

    None of a law given; where the runs allow no verdict, only which laws were not tried.
    """
    rows = verdict.get("laws") or []
    if not rows:
        return []
    unfit = [str(name) for name in verdict.get("laws_left_out") or []]
    if verdict.get("kind") == "insufficient":
        return [left_out(unfit)] if unfit else []
    own = (verdict["law"], verdict["command"])
    mine = next(row for row in rows if (row["law"], row["command"]) == own)
    z = short_z(mine.get("z_with_effects", mine["z_holdout"]))
    with_what = f" with {effect_names(mine['effects'])}" if mine.get("kind") == "effect" else ""
    count = len({row["law"] for row in rows})
    if not verdict.get("noise_known", True):
        out = [f"Of {count} laws {law_name(mine)}{with_what} has the least error on held-out runs."]
    elif verdict.get("kind") == "unknown":
        best = ""
        if "nearest" in mine:
            best = f", with {effect_names(mine['nearest'])} {short_z(mine['z_nearest'])}"
        out = [
            f"{count} laws were tried, each alone and with every effect, and none explains the "
            f"runs. {law_name(mine)} comes nearest: alone its error is {z} {NOISE}{best}."
        ]
    elif mine.get("z_with_effects", mine["z_holdout"]) > BENCH.clean:
        out = [
            f"Of {count} laws {law_name(mine)}{with_what} was taken; a part of the error remains: "
            f"on held-out runs it is {z} {NOISE}."
        ]
    else:
        out = [
            f"{law_name(mine)}{with_what} is the simplest of {count} laws that explains the runs."
        ]
    if unfit:
        out.append(left_out(unfit))
    if cut := verdict.get("not_tried"):
        out.append(_not_tried(cut))
    equal = [_pair_name(row) for row in verdict.get("equivalent") or []]
    if equal:
        more = f", and {len(equal) - MOST_EQUAL} more" if len(equal) > MOST_EQUAL else ""
        does = "do others" if len(equal) > 1 else "does another"
        text = joined(equal[:MOST_EQUAL]) if not more else ", ".join(equal[:MOST_EQUAL])
        out.append(f"As far as these runs tell, so {does}: {text}{more}.")
    return out


def left_out(laws: Sequence[str]) -> str:
    """Return the sentence that tells which laws were not tried, and why."""
    verb = "are" if len(laws) > 1 else "is"
    return f"{joined(laws)} {verb} left out: the force is not a number on these runs."


def _not_tried(cut: Mapping[str, Sequence[str]]) -> str:
    """Return the sentence that tells where the search ended: of which laws what was not tried."""
    parts = [
        f"{what} of {joined(cut[key])}"
        for key, what in (("effects", "effects"), ("two_effects", "two effects at once"))
        if cut.get(key)
    ]
    return f"Not tried, because the search had taken long enough: {joined(parts)}."


def _pair_name(row: Row) -> str:
    effects = row.get("effects") or []
    return f"{law_name(row)} {f'with {effect_names(effects)}' if effects else 'alone'}"


def law_table(rows: Sequence[Row]) -> list[list[str]]:
    """Return the cells of the table of laws, one row per law as in verdict.json; see `HEADER`."""
    known = [row[key] for row in rows for key in ERRORS if row.get(key)]
    size = max((one["signal_all"] for one in known), default=0.0)
    return [_cells(row, size) for row in rows]


def _cells(row: Row, size: float) -> list[str]:
    half, above = row.get("interval95"), row["z_above_best"]  # None where no noise is known
    spread = f" ± {half:.2f}" if half is not None else ""
    return [
        str(row["law"]), str(row["command"]), str(row["fitted"]),
        short_z(row["z_train"]), short_z(row["z_holdout"]),
        f"{above:.2f}{spread}" if above else "best",
        *(ForceError.of(one).text("N", size) if (one := row.get(key)) else "not judged"
          for key in ERRORS),
    ]  # fmt: skip


Verdict = Mapping[str, Any]

TONES = {
    "none": "green", "effect": "blue", "ambiguous": "purple", "unknown": "red", "insufficient": "",
}  # fmt: skip
"""The kinds of a verdict, and the colour of each."""


def sentences(verdict: Verdict) -> list[str]:
    """Return what a verdict says, one sentence or a few in each text, the most important first."""
    out = [headline(verdict), *reasons(verdict)]
    out += fault_texts(verdict, " ".join(out))
    return list(dict.fromkeys(text for text in out if text))


def reasons(verdict: Verdict) -> list[str]:
    """Return why a verdict is as it is, in sentences, the most important first."""
    out = [*law_sentences(verdict), *(verdict.get("reasons") or [])]
    return [*out, *_besides(verdict), *_limits(verdict), *_remaining(verdict), *_gains(verdict)]


def headline(verdict: Verdict) -> str:
    """Return the verdict in one sentence."""
    kind, effects = verdict.get("kind"), effects_at(verdict)
    model = f"the law {law_name(verdict)}" if verdict.get("laws") else "the model"
    if kind == "effect":
        return f"Missing from {model}: {joined(effects)}."
    if kind == "ambiguous":
        which = " or ".join(effects) if len(effects) == 2 else _one_of(effects)
        return f"Missing from {model}: {which}. These runs cannot tell them apart."
    if kind == "unknown":
        return f"Something is missing from {model} that no effect of the library explains."
    if kind == "none":
        return f"Nothing is missing from {model}: it explains these runs to within their noise."
    return "These data do not allow a verdict."


def effects_at(verdict: Verdict) -> list[str]:
    """Return the effects as people write them, with their sites where the rig has several."""
    sites, findings = verdict.get("sites") or {}, verdict.get("findings") or []
    several = bool(set(sites.values()) - {DAMPER}) or len(findings) > 1
    names = [str(name) for name in verdict.get("effects") or []]
    if verdict.get("kind") == "ambiguous":
        names += [str(one) for one in verdict.get("alternatives") or []]
    if not several:
        return [effect_name(one) for one in names]
    at = {one: [found["site"] for found in findings if one in found["effects"]] for one in names}
    places = {one: at[one] if len(at[one]) > 1 else [sites[one]] for one in names if one in sites}
    return [
        f"{effect_name(one)} ({_sites(places[one])})" if one in places else effect_name(one)
        for one in names
    ]


def _sites(sites: Sequence[str]) -> str:
    """Return sites in brackets behind an effect: "damper", "isolation layer, storey 1"."""
    return ", ".join(site_name(site).removeprefix("the ") for site in sites)


def _gains(verdict: Verdict) -> list[str]:
    """Return what known effects gain, where none of them explains what is missing."""
    rows = verdict.get("gains") or []
    texts = [
        f"{effect_name(row['effects'][0])} by {percent(row['gain'], 0)}"
        for row in rows
        if len(row["effects"]) == 1
    ]
    each = ", each added alone" if len(texts) > 1 else ""
    out = [f"What lowers the error most: {joined(texts)}{each}."] if texts else []
    return out + [
        f"{capitalised(effect_names(row['effects']))} together lower it by "
        f"{percent(row['gain'], 0)}."
        for row in rows
        if len(row["effects"]) > 1
    ]


def _one_of(effects: Sequence[str]) -> str:
    return f"one of {joined(effects)}" if len(effects) > 1 else joined(effects) or "an effect"


def _besides(verdict: Verdict) -> list[str]:
    """Return that other sites miss an effect, where something unknown is missing at one."""
    effects = effects_at(verdict) if verdict.get("kind") == "unknown" else []
    return [f"Missing besides: {joined(effects)}."] if effects else []


def _limits(verdict: Verdict) -> list[str]:
    share = verdict.get("detectable")
    if verdict.get("kind") != "none" or not isinstance(share, int | float):
        return []
    return [f"No other effect of the library is above {100.0 * share:.2g} % of the force."]


def _remaining(verdict: Verdict) -> list[str]:
    """Return the sentence about the coordinate of what no effect explains."""
    coordinate = str(verdict.get("coordinate") or "")
    if verdict.get("kind") != "unknown" or not coordinate:
        return []
    findings = verdict.get("findings") or []
    at = next((found for found in findings if found["kind"] == "unknown"), verdict)
    organised, name = at.get("organised"), name_of(coordinate, at.get("site", ""))
    sure = organised is None or coordinate == "frequency"
    sure = sure or any(
        one["p"] <= BENCH.chance for one in organised or [] if one["coordinate"] == coordinate
    )
    if sure and (beside := at.get("coordinate_beside")):
        return [
            f"With {effect_names(beside)}, which comes nearest, the remaining error depends "
            f"mainly on {name}; `bristle compare` shows the error of the model without it."
        ]
    if sure:
        return [f"The remaining error depends mainly on {name}."]
    return [f"The remaining error may depend on {name}, but that may be chance."]


def fault_texts(verdict: Verdict, already: str = "") -> list[str]:
    """Return the sentences of sensors' faults; runs with the same fault are told in one text.

    The last one says where the verdict is on data with the faults set right.

    Parameters
    ----------
    verdict : the content of verdict.json
    already : what is said already; faults whose sentence is in it are left out
    """
    alike: dict[tuple[str, ...], list[Mapping[str, Any]]] = defaultdict(list)
    faults = verdict.get("sensors") or []
    for k, fault in enumerate(one for one in faults if _words(one) not in already):
        alone = () if fault.get("run") else (str(k),)
        alike[fault["channel"], fault["fault"], *alone].append(fault)
    texts = [_fault_text(*faults) for faults in alike.values()]
    if any(map(_is_set_right, faults)):
        texts.append("The verdict and its numbers are for the runs with that corrected.")
    return texts


def _is_set_right(fault: Mapping[str, Any]) -> bool:
    """Return whether a verdict is on runs without a fault, which stays in the study's data."""
    kind = str(fault["fault"])
    effect = "" if fault.get("run") else instrument_of(str(fault["channel"]), kind)
    return not effect and kind not in ("clipping", "unrelated")


def _fault_text(first: Mapping[str, Any], *others: Mapping[str, Any]) -> str:
    """Return the sentence of a fault, and in which other runs it is."""
    same = joined([f"{fault['run']} ({_size(fault)})" for fault in others])
    return f"{_words(first)} The same in {same}." if others else _words(first)


def _words(fault: Mapping[str, Any]) -> str:
    text = str(fault.get("words") or "")
    return text or f"Sensor: {fault['fault']} of {fault['channel']}, {_size(fault)}."


FAULTS = ("channel", "fault", "value", "run")
"""Columns of the table of sensors' faults."""


def fault_rows(verdict: Verdict) -> list[list[str]]:
    """Return the cells of the table of sensors' faults, a row per fault; see `FAULTS`."""
    return [
        [str(one["channel"]), str(one["fault"]), _size(one), _runs(one)]
        for one in verdict.get("sensors") or []
    ]


def _runs(fault: Mapping[str, Any]) -> str:
    """Return the runs that have a fault, as a cell of a table."""
    return str(fault.get("run") or ", ".join(fault.get("runs") or []) or "all")


def _size(fault: Mapping[str, Any]) -> str:
    return size_text(str(fault["channel"]), str(fault["fault"]), float(fault["value"]))


def drive_of(verdict: Verdict) -> Drive:
    """Return what commands the damper in a verdict's runs."""
    measured = verdict.get("noise_floor") or {}
    return next((drive for name, drive in DRIVES.items() if name in measured), VOLTAGE)


def about(effect: str, drive: Drive = VOLTAGE) -> str:
    """Return what an effect is with a command, as a sentence: the first line of its text."""
    if effect not in EFFECTS:
        return f"{effect} is an effect of the user's own."
    return f"{text_for(EFFECTS[effect].first_line().rstrip('.'), drive)}."


def untestable(verdict: Verdict) -> list[str]:
    """Return the effects that the data could not show, with their sites where there are several.

    Where no run would show one, for a part of the damper's law absorbs it, that is said with it.
    """
    findings = verdict.get("findings") or []
    out = []
    for name in map(str, verdict.get("untestable") or []):
        sites = [found["site"] for found in findings if name in found.get("untestable", [])]
        notes = [_sites(sites)] if len(findings) > 1 and sites else []
        notes += _absorbing(name, sites or [DAMPER], verdict)
        named = effect_name(name)
        out.append(f"{named} ({': '.join(notes)})" if notes else named)
    return out


def _absorbing(name: str, sites: Sequence[str], verdict: Verdict) -> list[str]:
    """Return what part of the damper's law absorbs an effect, in a list; none where none does."""
    part = EFFECTS[name].absorbed_by if name in EFFECTS else ""
    ranking = verdict.get("ranking") or []
    # A law without that part is offered the effect; in a reconstructed force it is the layer's.
    offered = verdict.get("force") != "reconstructed" and any(
        (row["effect"], row.get("site")) == (name, DAMPER) for row in ranking
    )
    return (
        [f"it hides in the law's {part} force"] if part and DAMPER in sites and not offered else []
    )


LIMITS = ("effect", "at most (95 %)", "of force", "named from")
"""Columns of the table of limits."""

LIMITS_NOTES = (
    "At most: the size that these runs do not exclude, with all other parameters fitted again.",
    "Named from: about the size at which 9 of 10 verdicts would name it.",
)


def limit_rows(verdict: Verdict) -> list[list[str]]:
    """Return the cells of the table of limits, a row per effect; see `LIMITS`."""
    findings = verdict.get("findings") or []
    rows = []
    for found in findings:
        site = f" ({_sites([found['site']])})" if len(findings) > 1 else ""
        for one in found.get("limits") or []:
            rows.append([f"{effect_name(one['effect'])}{site}", *_limit_cells(one)])
    return rows


def _limit_cells(limit: Mapping[str, Any]) -> list[str]:
    if limit.get("why"):
        return [str(limit["why"]), "", ""]
    unit = limit["unit"]
    named = limit["named_from"]
    return [
        f"{limit['parameter']} {limit['side']} {quantity(limit['limit95'], unit, 2, fine=True)}",
        f"{100.0 * limit['share']:.2g} %" if limit["share"] is not None else "below a sample",
        quantity(named, unit, 2, fine=True) if named is not None else "no size",
    ]


def separating(verdict: Verdict) -> str:
    """Return the experiment that would distinguish alternatives, "" where none is named."""
    found = verdict.get("separate_by")
    if isinstance(found, Mapping):
        text = found.get("words") or found.get("text")
        return str(text or ", ".join(f"{key}: {value}" for key, value in found.items()))
    return str(found or "")


def sited(site: str, reason: str) -> str:
    """Return a reason with the site that it is about: "At storey 2: with duffing ..."."""
    return f"At {site_name(site)}: {reason[:1].lower()}{reason[1:]}"


# What the values of a named effect mean, in sentences for the verdict.


def effect_words(found: SiteDiagnosis) -> list[str]:
    """Return what the values of a site's effects mean, of those that say it.

    Parameters
    ----------
    found : the site's finding
    """
    if found.kind != "effect" or found.after is None:
        return []
    model = found.after.model
    out = []
    for name in (one for one in found.effects if one in EFFECTS and one in model.effects):
        effect = EFFECTS[name]
        if hasattr(effect, "in_words") and not effect.changes:  # told with its interval over runs
            values = {own: model.value(f"{name}.{own}") for own in effect.parameters}
            out.append(str(effect.in_words(effect.values_of(values))))
    return out
