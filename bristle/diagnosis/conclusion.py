"""What the sites of a rig show, put together into one verdict."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from ..comparison.names import effect_name
from ..core.finding import Finding
from ..data.corrections import TIMING, Correction
from ..identification.rig import DAMPER
from ..physics.effect import EFFECTS, Effect, effects_of, plain_name
from . import words
from .decision import NOISE
from .load_cell import FORCE_GAIN, low_pass_text
from .prepared import Insufficient
from .rule import BENCH, SITE
from .sensor_faults import instruments_of
from .site_diagnosis import SiteDiagnosis
from .verdict import Diagnosis
from .words import effect_words

LAYER = "layer"
"""The site beside which a building's damper stands, as a rule."""

ELSEWHERE = "{name} of the isolation layer and one of the damper add up to one force"
WITHOUT_LOAD_CELL = "Without a measured force {}: a load cell at the damper would distinguish them."
LITTLE = "Little beside what was found:"
NOT_DRIVEN = "Something that changed during the runs, and was not recorded, would look like this."


@dataclass(frozen=True)
class VerdictContext:
    """What a verdict tells beside what the sites show.

    `force` of a damper is "measured" or "reconstructed"; `sensors` the faults that channels show;
    `noise` that of each channel, in SI; `notes` further sentences; `driven` whether voltage or
    current was recorded, as far as that matters; `beside_layer` whether a building's damper is
    beside the isolation layer, so that a reconstructed force is that of both.
    """

    force: str = "measured"
    sensors: tuple[Finding, ...] = ()
    noise: Mapping[str, float] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    driven: bool = True
    beside_layer: bool = True


def conclude(findings: Mapping[str, SiteDiagnosis], context: VerdictContext) -> Diagnosis:
    """Return one verdict from what the sites of a rig show.

    Parameters
    ----------
    findings : by site, the damper's last
    context : what else is known of the runs
    """
    if context.force == "measured" and context.beside_layer:
        damper = findings.get(DAMPER)
        findings = {site: _after_the_force(found, damper) for site, found in findings.items()}
    if not context.driven:
        findings = {site: _without_command(found) for site, found in findings.items()}
    reconstructed = context.force == "reconstructed" and context.beside_layer
    sensors = _sensors(findings, context)
    parts = [replace(f, kind="none", effects=()) if _is_gain(f) else f for f in findings.values()]
    parts = _beside_what_is_found(parts)
    named: list[str] = []
    rivals: list[str] = []
    alike: dict[str, str] = {}
    sites: dict[str, str] = {}
    for part in parts:
        twins = lookalikes(part.effects) if reconstructed and part.site == DAMPER else {}
        alike |= twins
        # What is no effect, such as a mass of the base, is told in words: nobody can add it. So is
        # another place of the effect itself: what is missing has one name.
        others = [one for one in twins if one in EFFECTS and plain_name(one) not in part.effects]
        sure = part.kind == "effect" and not others
        known = [*(one for one in part.effects if one in EFFECTS), *others]
        (named if sure else rivals).extend(known if part.kind != "unknown" else [])
        acting = [*part.effects, *known]
        sites.update({e: sites.get(e, _site_of(e, part.site)) for e in acting})
    kind = _kind_of([part.kind for part in parts], named, rivals)
    if kind in ("none", "effect", "insufficient") and (shown := instruments_of(sensors)):
        kind, named = "effect", [*shown, *named]
        sites |= dict.fromkeys(shown, "sensor")
    effects = tuple(dict.fromkeys([*named, *rivals]))
    unknown = next((part for part in parts if part.kind == "unknown"), None)
    reasons = [
        *_reasons(parts, kind),
        *filter(None, map(low_pass_text, parts)),
        *(text for part in parts for text in effect_words(part)),
        *context.notes,
        *(WITHOUT_LOAD_CELL.format(why) for why in alike.values()),
    ]
    if kind == "unknown" and not context.driven:
        reasons.append(NOT_DRIVEN)
    return Diagnosis(
        kind, effects[: BENCH.most_alternatives] if kind == "ambiguous" else effects,
        tuple(reasons), findings, sensors, _untestable(findings, effects, reconstructed),
        unknown.coordinate if unknown else "", sites,
        tuple(one for one in alike if one not in effects), context.force, context.noise,
    )  # fmt: skip


def insufficient(lacking: Insufficient) -> Diagnosis:
    """Return the verdict on data that carry none."""
    return Diagnosis(
        "insufficient", (), lacking.reasons, sensors=lacking.faults, noise=lacking.noise
    )


def _without_command(found: SiteDiagnosis) -> SiteDiagnosis:
    """Return a finding that does not speak of effects of a command, where none was recorded."""
    of_it = {effect.name for effect in EFFECTS.values() if "V" in effect.needs}
    return replace(
        found,
        untestable=tuple(name for name in found.untestable if name not in of_it),
        limits=tuple(one for one in found.limits if one.effect not in of_it),
    )


def _sensors(findings: Mapping[str, SiteDiagnosis], context: VerdictContext) -> tuple[Finding, ...]:
    """Return the faults of all sensors; what a site tells anew takes the place of the first."""
    renewed = [fault for found in findings.values() for fault in found.sensors]
    again = {(one.channel, one.kind) for one in renewed}
    first = [one for one in context.sensors if (one.channel, one.kind) not in again]
    return (*first, *_of_load_cell(findings), *renewed)


def _after_the_force(found: SiteDiagnosis, damper: SiteDiagnosis | None) -> SiteDiagnosis:
    """Return what the layer shows, no verdict where the damper's runs contradict each other.

    The measured force is in its equilibrium, and so is what is wrong with it.
    """
    waits = damper is not None and damper.kind == "insufficient"
    if found.site != LAYER or found.kind != "unknown" or not waits:
        return found
    why = (
        f"The error is {found.z_before:.2f} {NOISE}, by an equilibrium that has the damper's force "
        "in it: that is to be set right first."
    )
    return replace(found, kind="insufficient", reasons=(why,))


def _beside_what_is_found(parts: Sequence[SiteDiagnosis]) -> list[SiteDiagnosis]:
    """Return what sites show, a little beside a clear finding as told in words alone.

    Where an effect is found, another site may show a trace of it, of the instruments, or of what
    the file has wrong. That takes nothing from the name, and adds none.
    """
    found = [part for part in parts if part.kind in ("effect", "ambiguous") and part.noise_known]
    if not found:
        return list(parts)
    clear = max(found, key=lambda part: part.z_before)
    little = max(SITE.excess(SITE.beside), SITE.trace * SITE.excess(clear.z_before))
    return [
        replace(part, kind="none", effects=(), reasons=(f"{LITTLE} {' '.join(part.reasons)}",))
        if part is not clear
        and part.kind != "none"
        and part.noise_known
        and SITE.excess(part.z_before) <= little
        else part
        for part in parts
    ]


def _kind_of(kinds: Sequence[str], named: Sequence[str], rivals: Sequence[str]) -> str:
    """Return the kind of the verdict that sites of these kinds amount to."""
    if "unknown" in kinds:
        return "unknown"
    if named or rivals:
        return "ambiguous" if rivals else "effect"
    return "insufficient" if "insufficient" in kinds else "none"


def _reasons(parts: Sequence[SiteDiagnosis], kind: str) -> list[str]:
    """Return why the verdict is what it is, each reason with its site where there are several."""
    if len(parts) == 1:
        return list(parts[0].reasons)
    if kind == "none" and parts:
        low, high = (f(part.z_before for part in parts) for f in (min, max))
        sites = f"at the {len(parts)} sites"
        out = [f"The error on held-out runs is {low:.2f} to {high:.2f} {NOISE} {sites}."]
        parts = [part for part in parts if part.z_before > BENCH.clean]
    else:
        in_words = [part for part in parts if part.kind == "none" and part.reasons]
        little = [part for part in in_words if part.reasons[0].startswith(LITTLE)]
        out, parts = [], [*(part for part in parts if part.kind != "none"), *little]
    return out + [words.sited(part.site, " ".join(part.reasons)) for part in parts if part.reasons]


def _untestable(
    findings: Mapping[str, SiteDiagnosis], effects: tuple[str, ...], reconstructed: bool
) -> tuple[str, ...]:
    """Return the effects, not those named, that some site's runs do not show.

    Without a load cell the damper's law absorbs others entirely.
    """
    names = {name for found in findings.values() for name in found.untestable}
    if reconstructed:
        names |= {effect.name for effect in effects_of("structure") if effect.absorbed_by}
    return tuple(sorted(names - set(effects)))


def _site_of(effect: str, site: str) -> str:
    """Return where an effect is that was found at a site: in the layer if it is the structure's."""
    known = EFFECTS.get(effect)
    return LAYER if site == DAMPER and known and known.site == "structure" else site


def lookalikes(effects: tuple[str, ...]) -> dict[str, str]:
    """Return what else would do the same to a reconstructed force as these effects, and why."""
    twins: dict[str, str] = {}
    for name in (name for name in effects if name in EFFECTS):
        effect, why = EFFECTS[name], ELSEWHERE.format(name=effect_name(name))
        own = {effect.key(site): why for site in effect.sites[1:] if not _has_twin(effect, site)}
        for twin, why in {**effect.lookalikes, **own}.items():
            if twin not in effects:
                twins.setdefault(twin, why)
    return twins


def _has_twin(effect: type[Effect], site: str) -> bool:
    """Return whether an effect's lookalikes, or a part of the law, are what it would be there."""
    others = [EFFECTS[twin] for twin in effect.lookalikes if twin in EFFECTS]
    return bool(effect.absorbed_by) or any(site in other.sites for other in others)


def _is_gain(finding: SiteDiagnosis) -> bool:
    return FORCE_GAIN in finding.effects


def _of_load_cell(findings: Mapping[str, SiteDiagnosis]) -> list[Finding]:
    """Return the faults of the load cell that equilibrium shows and that are no effects."""
    out = []
    for finding in findings.values():
        if _is_gain(finding):
            gain = float(finding.coordinate)
            text = f"The load cell shows {gain:.4g} times the force that equilibrium requires"
            if finding.noise_known:
                before, after = finding.z_before, finding.z_after
                text += f" (error {before:.3g} {NOISE}, {after:.3g} with that corrected)"
            text += "."
            out.append(
                Finding("gain", "warning", text, channel="force", value=gain, std=float("nan"))
            )
    return out


# Which faults of a verdict study.toml can set right, and the corrections that do.

OF_ALL = ("clock", "slew", "range")
"""Faults that all runs share: of a logger, or of the amplifier of a command."""
OF_ONE = TIMING
"""Faults that are set right where a single run has them; late in all runs is an effect."""


def is_correctable(fault: Mapping[str, Any]) -> bool:
    """Return whether a correction in study.toml sets a fault of verdict.json right."""
    return fault["fault"] in (OF_ONE if fault.get("run") else OF_ALL)


def corrections_of(
    verdict: Mapping[str, Any] | None, runs: Sequence[str]
) -> dict[str, list[Correction]]:
    """Return the corrections that a verdict's faults ask for, by the name of the run.

    Parameters
    ----------
    verdict : the content of verdict.json; None where there is none
    runs : names of all runs, for what all of them share
    """
    out: dict[str, list[Correction]] = {}
    for fault in (verdict or {}).get("sensors") or []:
        if not is_correctable(fault):
            continue
        one = Correction(str(fault["channel"]), str(fault["fault"]), float(fault["value"]))
        for run in [str(fault["run"])] if fault.get("run") else runs:
            out.setdefault(run, []).append(one)
    return out
