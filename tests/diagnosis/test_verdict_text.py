"""A verdict in words, from verdict.json of any schema."""

from __future__ import annotations

import json

import pytest

from bristle.core.finding import Finding
from bristle.diagnosis.conclusion import VerdictContext, conclude
from bristle.diagnosis.site_diagnosis import SiteDiagnosis
from bristle.diagnosis.verdict import current
from bristle.diagnosis.view import verdict_view
from bristle.diagnosis.words import TONES, fault_rows, fault_texts, headline, sentences, untestable
from bristle.errors import StudyError
from bristle.study.history import History
from bristle.study.study import Study
from bristle.view import terminal
from bristle.view.blocks import Table


def at(site, kind="none", *effects, **more):
    """Return what a site shows."""
    reasons = more.pop("reasons", ("With it z falls.",) if effects else ())
    return SiteDiagnosis(site, kind, effects, 3.0, 1.0, 0.9, 0.012, reasons=reasons, **more)


def said(**findings):
    return conclude(findings, VerdictContext()).as_dict()


@pytest.mark.parametrize(
    ("verdict", "says"),
    [
        ({"kind": "effect", "effects": ["a", "b"]}, "Missing from the model: a and b."),
        (
            {"kind": "ambiguous", "effects": ["a", "b"]},
            "Missing from the model: a or b. These runs cannot ",
        ),
        (
            {"kind": "ambiguous", "effects": ["a", "b", "c"]},
            "Missing from the model: one of a, b and c. ",
        ),
        ({"kind": "unknown", "effects": []}, "Something is missing from the model that no effect "),
        (
            {"kind": "none", "effects": []},
            "Nothing is missing from the model: it explains these runs ",
        ),
        ({"kind": "insufficient", "effects": []}, "These data do not allow a verdict."),
    ],
)
def test_every_kind_has_a_headline(verdict, says):
    assert verdict["kind"] in TONES
    assert headline(verdict).startswith(says)


def test_a_bench_names_no_site_and_a_building_does():
    assert said(damper=at("damper", "effect", "stribeck"))["words"] == (
        "Missing from the model: Stribeck effect. With it z falls."
    )
    both = said(layer=at("layer", "effect", "duffing"), damper=at("damper", "effect", "stribeck"))
    assert both["words"] == (
        "Missing from the model: Duffing spring (isolation layer) and Stribeck effect (damper). "
        "At the isolation layer: with it z falls. At the damper: with it z falls."
    )


def test_an_effect_at_two_sites_and_one_that_looks_alike_have_their_sites():
    both = {f"storey{i}": at(f"storey{i}", "effect", "storey_softening") for i in (1, 2)}
    assert headline(said(**both)) == (
        "Missing from the model: storey softening (storey 1, storey 2)."
    )
    damper = {"storey1": at("storey1"), "damper": at("damper", "effect", "gas_spring")}
    verdict = conclude(damper, VerdictContext("reconstructed")).as_dict()
    assert verdict["sites"] == {"gas_spring": "damper", "duffing": "layer"}
    assert headline(verdict).startswith(
        "Missing from the model: gas spring (damper) or Duffing spring (isolation layer). "
    )


def test_what_the_rest_depends_on_is_told_with_how_sure_that_is():
    verdict = {"kind": "unknown", "effects": [], "coordinate": "rest", "reasons": []}
    chance = [{"coordinate": "rest", "share": 0.1, "p": 0.2}]
    assert "may be chance" in sentences({**verdict, "organised": chance})[-1]
    sure = [{**chance[0], "p": 0.001}]
    assert sentences({**verdict, "organised": sure})[-1].startswith("The remaining error depends ")
    assert "may be chance" not in sentences({**verdict, "coordinate": "frequency"})[-1]


def test_the_coordinate_of_a_storey_is_its_drift():
    storey = at("storey1", "unknown", coordinate="displacement", reasons=("No.",))
    assert said(storey1=storey, layer=at("layer"))["words"].endswith("depends mainly on drift.")


def test_effects_that_no_run_showed_are_told_with_their_sites():
    hidden = {"storey1": at("storey1", untestable=("storey_softening",)), "layer": at("layer")}
    verdict = said(**hidden)
    assert verdict["untestable"] == ["storey_softening"]
    assert untestable(verdict) == ["storey softening (storey 1)"]
    one = said(damper=at("damper", untestable=("coil_lag",)))
    assert untestable(one) == ["coil lag"]


def test_what_the_law_takes_up_is_told_with_the_part_that_does():
    hidden = at("damper", untestable=("base_friction",))
    told = "it hides in the law's yield force"
    assert untestable(said(damper=hidden)) == [f"base friction ({told})"]
    building = said(layer=at("layer"), damper=hidden)
    assert untestable(building) == [f"base friction (damper: {told})"]
    # In the layer it is another friction, which these runs alone do not show.
    layer = said(layer=at("layer", untestable=("base_friction",)), damper=at("damper"))
    assert untestable(layer) == ["base friction (isolation layer)"]
    # A law that has no such part is offered it.
    tried = {**said(damper=hidden), "ranking": [{"effect": "base_friction", "site": "damper"}]}
    assert untestable(tried) == ["base friction"]
    late = conclude({"damper": at("damper")}, VerdictContext("reconstructed")).as_dict()
    assert untestable({**late, "ranking": tried["ranking"]}) == [f"base friction ({told})"]


def test_a_fault_is_told_once():
    text = "Velocity lags."
    lag = Finding("lag", "warning", text, channel="velocity", value=0.004, std=1e-4)
    verdict = conclude({"damper": at("damper")}, VerdictContext(sensors=(lag,))).as_dict()
    assert verdict["words"].count(text) == 1
    assert verdict["effects"] == ["velocity_sensor"]


def test_runs_that_contradict_each_other_leave_no_verdict_where_nothing_else_is_named():
    bad = at("storey1", "insufficient", reasons=("One model does not explain all runs.",))
    assert said(storey1=bad, layer=at("layer"))["kind"] == "insufficient"
    assert said(storey1=bad, layer=at("layer", "effect", "duffing"))["kind"] == "effect"
    assert said(storey1=bad, layer=at("layer", "unknown"))["kind"] == "unknown"


def test_all_that_is_to_be_done_for_a_verdict_is_told_without_details():
    lacking = [f"Run {k} is at rest. {'Measure it with motion. ' * 20}".strip() for k in range(5)]
    shown = terminal.text(verdict_view({"kind": "insufficient", "reasons": lacking}))
    assert [k for k in range(5) if f"Run {k} is at rest" not in shown] == []


@pytest.mark.parametrize(("drive", "unit"), [("voltage", "V"), ("current", "A")])
def test_values_of_an_effect_have_the_unit_of_the_command(drive, unit):
    found = {"values": {"saturation.V_s": {"value": 2.1, "std": 0.1}}}
    verdict = {
        "kind": "effect", "effects": ["saturation"], "findings": [found],
        "noise_floor": {drive: 0.01},
    }  # fmt: skip
    assert f"V_s = 2.10 ± 0.20 {unit} (95 %)" in terminal.text(verdict_view(verdict))


def test_a_fit_that_was_left_before_its_end_does_not_raise_the_error():
    row = {"effect": "backlash", "z_train": 2.2, "z_holdout": 2.4, "gain": -1.3}
    rows = [{**row, "refined": False}, {**row, "effect": "delay", "refined": True}]
    view = verdict_view({"kind": "none", "ranking": rows})
    (table,) = (one for one in view.every(Table) if one.title == "The evidence")
    assert [line[-2:] for line in table.rows[1:]] == [["nothing", "short"], ["-130.0 %", "full"]]


TOLD = {"schema": 2, "kind": "ambiguous", "effects": ["stribeck", "flattening"], "ranking": []}


def test_a_study_reads_the_verdict_that_it_wrote(tmp_path):
    study = Study.__new__(Study)
    study.folder, study.history = tmp_path, History(tmp_path)
    assert study.verdict() is None
    (tmp_path / "verdict.json").write_text(json.dumps(TOLD))
    assert study.verdict() == TOLD


@pytest.mark.parametrize("change", [{"schema": 1}, {"schema": None}, {"kind": "perhaps"}])
def test_a_verdict_that_this_version_does_not_know_is_refused(change):
    with pytest.raises(StudyError, match=r"rig/verdict\.json: (schema|kind) = .*diagnose"):
        current({**TOLD, **change}, "rig/verdict.json")


def late(run: str, value: float) -> dict:
    return {
        "channel": "force", "fault": "delay", "value": value, "words": f"In {run} it is late.",
        "run": run,
    }  # fmt: skip


def test_runs_with_the_same_fault_are_told_in_one_text_with_the_value_of_each():
    gain = {"channel": "velocity", "fault": "gain", "value": 1.1, "words": "A gain is off."}
    verdict = {"sensors": [late("a", 5e-4), gain, late("b", 5.24e-4), late("c", 5.43e-4)]}
    assert fault_texts(verdict) == [
        "In a it is late. The same in b (0.524 ms) and c (0.543 ms).", "A gain is off.",
        SET_RIGHT,
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("channel", "fault", "value", "told"),
    [
        ("force", "bias", 12345.0, "12.3 kN"),
        ("force", "delay", 2.1e-3, "2.1 ms"),
        ("force", "clock", -3e-5, "-30 ppm"),
        ("velocity", "gain", 1.1, "1.1"),
        ("velocity", "high-pass", 3.0, "3 rad/s"),
        ("current", "slew", 30.0, "30 A/s"),
    ],
)
def test_the_table_of_faults_says_the_value_with_its_unit_and_the_run(channel, fault, value, told):
    one = {"channel": channel, "fault": fault, "value": value}
    assert fault_rows({"sensors": [one]}) == [[channel, fault, told, "all"]]
    assert fault_rows({"sensors": [{**one, "run": "r1"}]})[0][3] == "r1"


SET_RIGHT = "The verdict and its numbers are for the runs with that corrected."


def test_a_verdict_says_that_it_is_on_runs_whose_faults_are_set_right():
    none = {"kind": "none", "effects": [], "reasons": ["z = 1.07."], "detectable": 0.01}
    assert sentences({**none, "sensors": [late("a", 5e-4)]})[-1] == SET_RIGHT
    lag = {"channel": "velocity", "fault": "lag", "value": 1e-3, "words": "Velocity lags."}
    ended = {"channel": "force", "fault": "clipping", "value": 9.0, "words": "Its range ended."}
    for sensors in ([], [lag], [ended]):  # a model holds the lag, clipped samples are left out
        assert SET_RIGHT not in sentences({**none, "sensors": sensors})
